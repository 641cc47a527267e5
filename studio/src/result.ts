// Result: footage and animated rig in step, the weights, the files to take away.

import * as api from "./api";
import { column, parse } from "./csv";
import type { AnimationSummary } from "./documents";
import { button, checkbox, choice, fill, h, labelled } from "./dom";
import { Ghost } from "./ghost";
import { overFrames } from "./plots";
import { rigPath } from "./poses";
import { RigView } from "./rigview";
import { attempt, offer, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

const ANIMATIONS = ["animation.glb", "animation.gltf"];
const SUMMARY = "animation.json";
const WEIGHTS = "keys/weights.csv";
const REPORT = "report.html";
const MOVIE = "animation.mp4";

const METHODS: [string, string][] = [
  ["auto", "automatic"],
  ["phase", "over the gait phase"],
  ["rbf", "radial basis"],
  ["switching", "switching between partners"],
];

const MIRROR: [string, string][] = [
  ["auto", "of symmetric gaits"],
  ["on", "always"],
  ["off", "never"],
];

async function animate(force = false): Promise<void> {
  const { kept, ran } = await store.run("animate", { force });
  if (kept.length > 0) {
    return offer(`${kept.join(", ")} was changed by hand and is kept.`, null, {
      label: "Make it anew, the change is lost",
      act: () => attempt(() => animate(true)),
    });
  }
  say(ran ? "The animation is made." : "The animation is up to date.");
}

/** What `animate` is asked for. */
function wishes(): HTMLElement[] {
  const { animation, feet } = store.opened.settings;
  const set = (name: string) => (value: unknown) => attempt(() => store.change(() => ({ [name]: value })));
  const number = (label: string, name: string, value: number, more: object, placeholder = "") => {
    const input = h("input", { type: "number", value: value ? String(value) : "", placeholder, step: "any", ...more });
    input.addEventListener("change", () => set(name)(input.value === "" ? null : Number(input.value)));
    return labelled(label, input);
  };
  return [
    choice("Between the poses", animation.method, METHODS, set("animation.method")),
    choice("Poses also with left and right exchanged", animation.mirror, MIRROR, set("animation.mirror")),
    checkbox("Poses grow and shrink as the strides do", animation.amplitude, set("animation.amplitude")),
    h(
      "div",
      { className: "row two" },
      number(
        "Frames a second",
        "animation.fps",
        animation.fps,
        { min: "1" },
        String(Number(store.opened.fps.toFixed(3))),
      ),
      number("Speed", "animation.retime", animation.retime, { min: "0.01" }, "1"),
    ),
    checkbox("A seamless loop of one stride", animation.loop_strides > 0, (on) =>
      set("animation.loop_strides")(on ? 1 : 0),
    ),
    checkbox("The animal travels over the ground", feet.root === "travel", (on) =>
      set("feet.root")(on ? "travel" : "in-place"),
    ),
    checkbox("Feet that are down are held", feet.plant, set("feet.plant")),
  ];
}

export function result(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const view = new RigView();
  const ghost = new Ghost(view, viewer.redraw);
  viewer.tool = ghost;
  const plots = h("div", { className: "weights" });
  main.classList.add("pair");
  main.append(viewer.element, view.element, plots);
  let summary: AnimationSummary | null = null;
  let shown = "";
  let weighed = "";
  let follow: (() => void) | null = null;

  const name = () => ANIMATIONS.find((file) => store.version(file));

  const pose = (frame = store.frame) => {
    if (!summary) return;
    // The animation is that of a segment of the clip; before it the first pose is held.
    const since = Math.max(0, frame - summary.first_frame);
    const seconds = since / store.opened.fps / summary.retime;
    // A loop is played over and over beside the footage.
    const duration = summary.loop ? summary.loop.duration_s : (summary.frames - 1) / summary.fps;
    view.pose(summary.animation, summary.loop ? seconds % duration : Math.min(seconds, duration));
    view.canvas.dataset["frame"] = String(frame);
  };

  const renew = async () => {
    const { shot, files } = store.opened;
    const file = name();
    const now = [file, file && files[file], files[SUMMARY], files[WEIGHTS]].join();
    if (now !== shown && file && files[SUMMARY]) {
      shown = now;
      summary = JSON.parse(await api.text(shot, SUMMARY)) as AnimationSummary;
      const rig = rigPath() ?? "";
      const folder = rig.slice(0, rig.lastIndexOf("/") + 1);
      await view.load(api.fileUrl(shot, file, files[file]), (other) => api.rigUrl(folder + decodeURIComponent(other)));
      const last = store.opened.frames - 1;
      const some = [...new Set([0, 0.2, 0.4, 0.6, 0.8].map((share) => Math.round(share * last)))];
      await ghost.face(some, pose);
      viewer.redraw();
    }
    if (files[WEIGHTS] && files[WEIGHTS] !== weighed) {
      weighed = files[WEIGHTS];
      follow = await drawWeights(plots);
    }
    draw();
  };

  const draw = () =>
    fill(
      inspector,
      h("h2", {}, "Result"),
      ...wishes(),
      button("Animate", () => attempt(() => animate()), {
        className: "main",
        id: "animate",
        disabled: store.job !== null,
      }),
      ...outcome(summary),
      checkbox("The rig's silhouette over the footage's", ghost.shown, (v) => {
        ghost.shown = v;
        viewer.redraw();
      }),
      h("h3", {}, "Export"),
      ...exports(),
    );
  draw();
  const refill = () => attempt(renew);
  refill();
  const ends = [
    store.on(["files"], refill),
    store.on(["job"], draw),
    store.on(["frame"], () => {
      pose();
      follow?.();
      if (ghost.shown) viewer.redraw();
    }),
  ];
  return () => {
    main.classList.remove("pair");
    ends.forEach((act) => act());
    viewer.end();
    view.end();
  };
}

/** The weights over the frames; what moves their cursor. */
async function drawWeights(into: HTMLElement): Promise<() => void> {
  const table = parse(await api.text(store.opened.shot, WEIGHTS));
  const series = [...table.keys()]
    .filter((c) => /^(key|mirrored)_/.test(c) || c === "sum")
    .map((c) => ({ name: c.replace("_", " "), values: column(table, c) }));
  const [plot, move] = overFrames(
    "The weight of each pose over the frames, and their sum",
    "weight, share of a pose",
    series,
    true,
  );
  into.replaceChildren(plot);
  return move;
}

function outcome(summary: AnimationSummary | null): (HTMLElement | null)[] {
  if (!summary) return [h("p", { className: "hint" }, "There is no animation yet. Every key needs a pose first.")];
  const { frames, fps, method, feet } = summary;
  const [low, high] = summary.weight_range.map((w) => w.toFixed(2));
  return [
    h("p", {}, `${frames} frames at ${Number(fps.toFixed(3))} a second, by ${method}; weights from ${low} to ${high}.`),
    feet?.gait ? h("p", {}, `The feet fall as in a ${feet.gait}.`) : null,
    ...(summary.exchanged_sides ?? []).map((key) =>
      h("p", { className: "warning" }, `The pose of key ${key} fits the others far better with left and right exchanged.`),
    ),
    ...(feet?.warnings ?? []).map((text) => h("p", { className: "warning" }, text)),
  ];
}

/** The files to take away, and what else can be made of them. */
function exports(): (HTMLElement | null)[] {
  const { shot, files } = store.opened;
  const take = (file: string, what: string) =>
    files[file]
      ? h(
          "li",
          {},
          h("a", { href: api.fileUrl(shot, file, files[file], true), download: file }, file),
          h("span", { className: "hint" }, what),
        )
      : null;
  const make = (id: string, label: string, movie: boolean, said: string) =>
    button(
      label,
      () =>
        attempt(async () => {
          await store.run("report", { movie });
          say(said);
        }),
      { id, disabled: store.job !== null || !store.version("masks/000000.png") },
    );
  return [
    h(
      "ul",
      { className: "files" },
      ...ANIMATIONS.map((file) => take(file, "your rig with the animation")),
      take("animation.bvh", "the same motion as BVH"),
      take(SUMMARY, "what was made, in numbers"),
      take(WEIGHTS, "the weights"),
      take(REPORT, "the page to send around"),
      take(MOVIE, "footage and rig side by side"),
    ),
    h(
      "div",
      { className: "row two" },
      make("report", "Write the report", false, "report.html is written."),
      make("movie", "Write a movie", true, `${MOVIE} is written.`),
    ),
    files[REPORT]
      ? h(
          "p",
          {},
          h(
            "a",
            { href: api.fileUrl(shot, REPORT, files[REPORT]), target: "_blank", rel: "noopener" },
            "Open the report",
          ),
        )
      : null,
  ];
}
