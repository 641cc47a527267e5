// Analysis: the verdict in words, the way through the components, their courses and spectra.

import * as api from "./api";
import { column, parse } from "./csv";
import { button, choice, fill, h } from "./dom";
import { overFrames, spectrum, trajectory } from "./plots";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

const GAITS = ["unknown", "symmetric", "asymmetric", "walk", "trot", "pace", "amble", "canter", "gallop", "bound"];

const DIAGNOSIS = "analysis/diagnosis.json";

export async function keyFrames(): Promise<{ key: number; frame: number; partner_of: number | null }[]> {
  if (!store.version("keys/keys.json")) return [];
  return JSON.parse(await api.text(store.opened.shot, "keys/keys.json")).keys;
}

export function analysis(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const plots = h("div", { className: "plots", tabIndex: 0, role: "region", "aria-label": "Plots" });
  main.classList.add("split");
  main.append(viewer.canvas, plots);
  let movers: (() => void)[] = [];
  let shown = "";

  const renew = async () => {
    const { shot, files } = store.opened;
    const versions = [DIAGNOSIS, "analysis/projections.csv", "analysis/spectrum.csv", "keys/keys.json"].map((n) => files[n] ?? "").join();
    if (versions === shown || !files[DIAGNOSIS]) return;
    shown = versions;
    const [diagnosis, projections, spectra, keys] = await Promise.all([
      api.text(shot, DIAGNOSIS).then(JSON.parse),
      api.text(shot, "analysis/projections.csv").then(parse),
      api.text(shot, "analysis/spectrum.csv").then(parse),
      keyFrames(),
    ]);
    const components: any[] = diagnosis.components;
    const scores = components.map((_, c) => ({ name: `PC${c + 1}`, values: column(projections, `pc${c + 1}`) }));
    const [way, moveWay] = trajectory(scores[0]!.values, scores[1]?.values ?? scores[0]!.values.map(() => 0), keys);
    const [courses, moveCourses] = overFrames("The components over the frames", "standard deviations", scores.slice(0, 3));
    movers = [moveWay, moveCourses];
    const amplitudes = scores.slice(0, 3).map((s, c) => ({ name: s.name, values: column(spectra, `amplitude_pc${c + 1}`) }));
    fill(
      plots,
      h("h3", {}, "Where the frames lie"),
      way,
      h("h3", {}, "Components over time"),
      courses,
      h("h3", {}, "Spectrum"),
      spectrum(column(spectra, "frequency_hz"), amplitudes, diagnosis.band_hz, diagnosis.step_hz),
      h("h3", {}, "Eigen-silhouettes"),
      eigenSilhouettes(components),
    );
    tell(diagnosis);
  };

  const verdict = h("div", {});
  const tell = (d: any) => {
    const list = (items: string[]) => h("ul", {}, ...items.map((text) => h("li", {}, text)));
    const row = (c: any, at: number) =>
      h("tr", {}, h("th", { scope: "row" }, `PC${at + 1}`), h("td", {}, `${(100 * c.variance_share).toFixed(1)} %`), h("td", {}, c.r.toFixed(2)), h("td", {}, `${c.peak_hz.toFixed(2)} Hz`));
    fill(
      verdict,
      h("p", { className: `verdict ${d.verdict}`, id: "verdict" }, d.verdict),
      list(d.reasons),
      d.advice.length > 0 ? h("h3", {}, "What to try") : null,
      list(d.advice),
      h("p", {}, `The silhouette repeats every ${d.step_frames.toFixed(1)} frames (${d.step_hz.toFixed(2)} Hz), ${d.cycles.toFixed(1)} times.`),
      h("p", {}, d.stride_hz ? `A stride takes ${d.stride_frames.toFixed(1)} frames.` : "Whether that is a step or a stride cannot be told from this view; name the gait if you know it."),
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, ...["", "variance", "r", "peak"].map((t) => (t ? h("th", { scope: "col" }, t) : h("td", {}))))),
        h("tbody", {}, ...components(d).map(row)),
      ),
    );
  };
  const components = (d: any): any[] => d.components;

  const draw = () => {
    const gait = store.opened.settings.analysis.gait;
    fill(
      inspector,
      h("h2", {}, "Analysis"),
      choice("Gait, if you know it", gait, GAITS.map((g) => [g, g]), (v) => attempt(() => store.change({ "analysis.gait": v }))),
      button("Analyse", () => attempt(async () => {
        const found = await store.run("analyze");
        say(`The clip is ${found?.verdict ?? "judged"}.`);
      }), { className: "main", id: "analyze", disabled: store.job !== null || !store.version("masks/000000.png") }),
      store.version("masks/000000.png") ? null : h("p", { className: "hint" }, "There are no silhouettes yet."),
      verdict,
    );
    attempt(renew);
  };
  draw();
  const ends = [store.on(["files", "job"], draw), store.on(["frame"], () => movers.forEach((m) => m()))];
  return () => {
    main.classList.remove("split");
    ends.forEach((act) => act());
    viewer.end();
  };
}

function eigenSilhouettes(components: unknown[]): HTMLElement {
  const { shot, files } = store.opened;
  const picture = (name: string, alt: string) =>
    files[name] ? h("figure", {}, h("img", { src: api.fileUrl(shot, name, files[name]), alt }), h("figcaption", {}, alt)) : null;
  const each = components.slice(0, 4).flatMap((_, c) =>
    [["minus", "−2"], ["plus", "+2"]].map(([sign, by]) => picture(`analysis/component_${c + 1}_${sign}.png`, `PC${c + 1} at ${by} deviations`)),
  );
  return h("div", { className: "eigen" }, picture("analysis/mean.png", "Mean silhouette"), ...each);
}
