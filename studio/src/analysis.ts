// Analysis: the verdict in words, the way through the components, their courses and spectra.

import * as api from "./api";
import { column, parse } from "./csv";
import type { Component, Diagnosis } from "./documents";
import { button, choice, fill, h } from "./dom";
import { keysVersion, readKeys } from "./keyfile";
import { overFrames, spectrum, trajectory } from "./plots";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

const GAITS = ["unknown", "symmetric", "asymmetric", "walk", "trot", "pace", "amble", "canter", "gallop", "bound"];

const DIAGNOSIS = "analysis/diagnosis.json";
const PROJECTIONS = "analysis/projections.csv";
const SPECTRUM = "analysis/spectrum.csv";

/** Components whose courses and spectra are shown. */
const SHOWN = 3;

export function analysis(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const plots = h("div", { className: "plots", tabIndex: 0, role: "region", "aria-label": "Plots" });
  const verdict = h("div", {});
  main.classList.add("split", "plotted");
  main.append(viewer.element, plots);
  fill(plots, h("p", { className: "empty" }, "The plots come here when the clip is analysed."));
  let movers: (() => void)[] = [];
  let shown = "";

  const renew = async () => {
    const { files } = store.opened;
    const versions = [...[DIAGNOSIS, PROJECTIONS, SPECTRUM].map((n) => files[n] ?? ""), keysVersion()].join();
    if (versions === shown || !files[DIAGNOSIS]) return;
    shown = versions;
    const diagnosis = JSON.parse(await api.text(store.opened.shot, DIAGNOSIS)) as Diagnosis;
    movers = await drawPlots(plots, diagnosis);
    fill(verdict, ...told(diagnosis));
  };

  const draw = () => {
    const has = store.version("masks/000000.png") !== "";
    fill(
      inspector,
      h("h2", {}, "Analysis"),
      choice(
        "Gait, if you know it",
        store.opened.settings.analysis.gait,
        GAITS.map((g) => [g, g]),
        (v) => attempt(() => store.change(() => ({ "analysis.gait": v }))),
      ),
      button(
        "Analyse",
        () =>
          attempt(async () => {
            const { ran, result } = await store.run<Diagnosis>("analyze");
            say(ran ? `The clip is ${result.verdict}.` : "The analysis is up to date.");
          }),
        { className: "main", id: "analyze", disabled: store.job !== null || !has },
      ),
      has ? null : h("p", { className: "hint" }, "There are no silhouettes yet."),
      verdict,
    );
    attempt(renew);
  };
  draw();
  const ends = [store.on(["files", "job"], draw), store.on(["frame"], () => movers.forEach((m) => m()))];
  return () => {
    main.classList.remove("split", "plotted");
    ends.forEach((act) => act());
    viewer.end();
  };
}

/** Draws all plots; what moves their marks of the current frame. */
async function drawPlots(into: HTMLElement, diagnosis: Diagnosis): Promise<(() => void)[]> {
  const { shot } = store.opened;
  const [projections, spectra, keys] = await Promise.all([
    api.text(shot, PROJECTIONS).then(parse),
    api.text(shot, SPECTRUM).then(parse),
    readKeys(),
  ]);
  const scores = diagnosis.components.map((_, c) => ({
    name: `PC${c + 1}`,
    values: column(projections, `pc${c + 1}`),
  }));
  const first = scores[0]?.values ?? [];
  const [way, moveWay] = trajectory(first, scores[1]?.values ?? first.map(() => 0), keys?.keys ?? []);
  const [courses, moveCourses] = overFrames(
    "The components over the frames",
    "standard deviations",
    scores.slice(0, SHOWN),
  );
  const amplitudes = scores
    .slice(0, SHOWN)
    .map((s, c) => ({ name: s.name, values: column(spectra, `amplitude_pc${c + 1}`) }));
  const section = (title: string, plot: Element) => h("section", {}, h("h3", {}, title), plot);
  fill(
    into,
    section("Where the frames lie", way),
    section("Components over time", courses),
    section("Spectrum", spectrum(column(spectra, "frequency_hz"), amplitudes, diagnosis.band_hz, diagnosis.step_hz)),
    section("Eigen-silhouettes", eigenSilhouettes(diagnosis.components)),
  );
  return [moveWay, moveCourses];
}

/** The verdict in words. */
function told(d: Diagnosis): (HTMLElement | null)[] {
  const list = (items: string[]) => h("ul", {}, ...items.map((text) => h("li", {}, text)));
  const row = (c: Component, at: number) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, `PC${at + 1}`),
      ...[`${(100 * c.variance_share).toFixed(1)} %`, c.r.toFixed(2), `${c.peak_hz.toFixed(2)} Hz`].map((text) =>
        h("td", {}, text),
      ),
    );
  const stride =
    d.stride_hz === null || d.stride_frames === null
      ? "Whether that is a step or a stride cannot be told from this view; name the gait if you know it."
      : `A stride takes ${d.stride_frames.toFixed(1)} frames.`;
  return [
    h("p", { className: `verdict ${d.verdict}`, id: "verdict" }, d.verdict),
    list(d.reasons),
    d.advice.length > 0 ? h("h3", {}, "What to try") : null,
    list(d.advice),
    h("h3", {}, "Rhythm"),
    h(
      "p",
      {},
      `The silhouette repeats every ${d.step_frames.toFixed(1)} frames (${d.step_hz.toFixed(2)} Hz), ${d.cycles.toFixed(1)} times. ${stride}`,
    ),
    h(
      "table",
      {},
      h("thead", {}, h("tr", {}, h("td", {}), ...["variance", "r", "peak"].map((t) => h("th", { scope: "col" }, t)))),
      h("tbody", {}, ...d.components.map(row)),
    ),
  ];
}

function eigenSilhouettes(components: Component[]): HTMLElement {
  const { shot, files } = store.opened;
  const picture = (name: string, alt: string) =>
    files[name]
      ? h("figure", {}, h("img", { src: api.fileUrl(shot, name, files[name]), alt }), h("figcaption", {}, alt))
      : null;
  const each = components.slice(0, 4).flatMap((_, c) =>
    [
      ["minus", "−2"],
      ["plus", "+2"],
    ].map(([sign, by]) => picture(`analysis/component_${c + 1}_${sign}.png`, `PC${c + 1} at ${by} deviations`)),
  );
  return h("div", { className: "eigen" }, picture("analysis/mean.png", "Mean silhouette"), ...each);
}
