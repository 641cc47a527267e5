// Result: footage and animated rig in step, the weights, the files to take away.

import * as api from "./api";
import { column, parse } from "./csv";
import { button, checkbox, fill, h } from "./dom";
import { Ghost } from "./ghost";
import { overFrames } from "./plots";
import { rigPath } from "./poses";
import { RigView } from "./rigview";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

const ANIMATIONS = ["animation.glb", "animation.gltf"];

export function result(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const view = new RigView();
  const ghost = new Ghost(view);
  viewer.tool = ghost;
  const plots = h("div", { className: "weights" });
  main.classList.add("result");
  main.append(viewer.canvas, view.canvas, plots);
  let summary: any = null;
  let shown = "";
  let mover: (() => void) | null = null;

  const name = () => ANIMATIONS.find((file) => store.version(file));

  const pose = () => {
    if (!summary) return;
    const clip = summary.animation as string;
    const fps = (summary.fps as number) || store.opened.fps;
    // The animation is that of a segment of the clip; before it the first pose is held.
    const since = Math.max(0, store.frame - (summary.first_frame ?? 0));
    const seconds = since / store.opened.fps / (summary.retime ?? 1);
    // A loop is played over and over beside the footage.
    const duration = summary.loop ? (summary.loop.duration_s as number) : (summary.frames - 1) / fps;
    view.pose(clip, summary.loop ? seconds % duration : Math.min(seconds, duration));
    view.canvas.dataset["frame"] = String(store.frame);
  };

  const renew = async () => {
    const { shot, files } = store.opened;
    const file = name();
    const now = [file, file && files[file], files["animation.json"], files["keys/weights.csv"]].join();
    if (now === shown) return;
    shown = now;
    if (!file || !files["animation.json"]) return draw();
    summary = JSON.parse(await api.text(shot, "animation.json"));
    const rig = rigPath() ?? "";
    const folder = rig.includes("/") ? rig.slice(0, rig.lastIndexOf("/") + 1) : "";
    await view.load(api.fileUrl(shot, file, files[file]), (other) => api.rigUrl(folder + decodeURIComponent(other)));
    pose();
    if (files["keys/weights.csv"]) {
      const table = parse(await api.text(shot, "keys/weights.csv"));
      const series = [...table.keys()]
        .filter((c) => c.startsWith("key_") || c === "sum")
        .map((c) => ({ name: c.replace("key_", "key "), values: column(table, c) }));
      const [plot, move] = overFrames("The weight of each pose over the frames, and their sum", "weight", series);
      mover = move;
      plots.replaceChildren(plot);
    }
    draw();
  };

  const draw = () => {
    const { shot, files } = store.opened;
    const take = (file: string, what: string) =>
      files[file]
        ? h("li", {}, h("a", { href: api.fileUrl(shot, file, files[file], true), download: file }, file), ` ${what}`)
        : null;
    const feet = summary?.feet;
    fill(
      inspector,
      h("h2", {}, "Result"),
      button("Animate", () => attempt(async () => {
        await store.run("animate");
        say("The animation is made.");
      }), { className: "main", id: "animate", disabled: store.job !== null }),
      summary
        ? h("p", {}, `${summary.frames} frames at ${summary.fps} a second, by ${summary.method}; weights from ${summary.weight_range[0].toFixed(2)} to ${summary.weight_range[1].toFixed(2)}.`)
        : h("p", { className: "hint" }, "There is no animation yet. Every key needs a pose first."),
      feet?.gait ? h("p", {}, `The feet fall as in a ${feet.gait}.`) : null,
      ...((feet?.warnings ?? []) as string[]).map((text) => h("p", { className: "fault" }, text)),
      h("h3", {}, "View"),
      h(
        "div",
        { className: "row" },
        button("Side", () => view.side()),
        button("Other side", () => view.side(Math.PI)),
        button("Corner", () => view.side(0.7)),
      ),
      checkbox("The rig's silhouette over the footage's", ghost.shown, (v) => {
        ghost.shown = v;
        viewer.redraw();
      }),
      h("h3", {}, "Export"),
      h(
        "ul",
        { className: "files" },
        ...ANIMATIONS.map((file) => take(file, "your rig with the animation")),
        take("animation.bvh", "the same as BVH"),
        take("animation.json", "the summary"),
        take("keys/weights.csv", "the weights"),
        take("report.html", "the page to send around"),
      ),
      button("Write the report", () => attempt(async () => {
        await store.run("report");
        say("report.html is written.");
      }), { id: "report", disabled: store.job !== null || !store.version("masks/000000.png") }),
      files["report.html"]
        ? h("p", {}, h("a", { href: api.fileUrl(shot, "report.html", files["report.html"]), target: "_blank", rel: "noopener" }, "Open the report"))
        : null,
    );
  };
  draw();
  const refill = () => attempt(renew);
  refill();
  const ends = [
    store.on(["files"], refill),
    store.on(["job"], draw),
    store.on(["frame"], () => {
      pose();
      mover?.();
      if (ghost.shown) viewer.redraw();
    }),
  ];
  return () => {
    main.classList.remove("result");
    ends.forEach((act) => act());
    viewer.end();
    view.end();
  };
}
