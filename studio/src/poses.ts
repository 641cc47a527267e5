// Poses: the rig, its clips in 3D, and which of its poses belongs to which key.

import * as api from "./api";
import type { Key } from "./documents";
import { keysVersion, readKeys } from "./keyfile";
import { keyPicture, markCurrent } from "./keys";
import { browser } from "./browser";
import { button, choice, fill, h, slider } from "./dom";
import { RigView } from "./rigview";
import { attempt, complain, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

/** The rig's path below the root, of the path in the settings, which is relative to the shot. */
export function rigPath(): string | null {
  const { rig } = store.opened.settings.poses;
  if (!rig) return null;
  const parts = rig.startsWith("/") ? [] : store.opened.shot.split("/");
  for (const part of rig.split("/")) {
    if (part === "..") parts.pop();
    else if (part !== "." && part !== "") parts.push(part);
  }
  return parts.join("/");
}

export function poses(main: HTMLElement, inspector: HTMLElement): () => void {
  const view = new RigView();
  const sheet = h("div", { className: "sheet strip", tabIndex: 0, role: "region", "aria-label": "Poses of the keys" });
  const viewer = new Viewer();
  main.classList.add("pair");
  main.append(viewer.element, view.element, sheet);
  let clips: api.Clip[] = [];
  let clip = "";
  let time = 0;
  let all: Key[] = [];
  let loaded = "";
  let shown = "";

  const timeOf = (pose: api.PoseOfKey) => {
    const found = clips.find((c) => c.name === pose.clip);
    return pose.time ?? found?.frames[pose.frame ?? 0] ?? 0;
  };

  const assign = (key: number) => {
    const pose = { key, clip, time: Number(time.toFixed(4)) };
    attempt(() =>
      store.change(({ poses }) => ({
        "poses.pose": [...poses.pose.filter((p) => p.key !== key), pose].sort((a, b) => a.key - b.key),
      })),
    );
  };

  const chooseRig = () =>
    browser("Choose a rig (glTF or GLB)", ["rig"], (entry) =>
      attempt(async () => {
        await store.change(() => ({}), entry.path);
        say(`${entry.name} is the rig now.`);
      }),
    );

  const card = (k: Key) => {
    const pose = store.opened.settings.poses.pose.find((p) => p.key === k.key);
    return h(
      "article",
      { className: pose ? "key" : "key missing", "data-frame": String(k.frame) },
      h(
        "button",
        {
          type: "button",
          className: "show",
          "aria-label": `Show frame ${k.frame}`,
          onclick: () => store.setFrame(k.frame),
        },
        keyPicture(k.frame),
      ),
      h("p", {}, h("strong", {}, `Key ${k.key}`), h("span", { className: "hint" }, `frame ${k.frame}`)),
      h("p", { className: pose ? "" : "hint" }, pose ? `${pose.clip}, ${timeOf(pose).toFixed(3)} s` : "no pose yet"),
      h(
        "div",
        { className: "row" },
        button("Assign pose", () => assign(k.key), {
          disabled: clip === "",
          "data-assign": String(k.key),
          title: "The rig as it is shown, to this key",
        }),
        pose
          ? button(
              "Show",
              () => {
                clip = pose.clip;
                time = timeOf(pose);
                store.setFrame(k.frame);
                draw();
                view.pose(clip, time);
              },
              { title: "The key image and the pose it has" },
            )
          : null,
      ),
    );
  };

  const renew = async () => {
    const rig = rigPath();
    const { settings } = store.opened;
    const now = JSON.stringify([rig, keysVersion(), settings.poses]);
    if (now === shown) return;
    shown = now;
    all = (await readKeys())?.keys ?? [];
    if (rig && rig !== loaded) {
      loaded = rig;
      clips = (await api.rigClips(rig)).clips;
      const first = settings.poses.pose.find((p) => clips.some((c) => c.name === p.clip));
      clip = first?.clip ?? clips[0]?.name ?? "";
      time = first ? timeOf(first) : 0;
      const folder = rig.includes("/") ? rig.slice(0, rig.lastIndexOf("/") + 1) : "";
      await view.load(api.rigUrl(rig), (name) => api.rigUrl(folder + decodeURIComponent(name)));
      view.pose(clip, time);
    }
    fill(sheet, ...all.map(card));
    if (all.length === 0) fill(sheet, h("p", { className: "empty" }, "There are no keys yet: choose them under Keys."));
    markCurrent(sheet);
    draw();
  };

  /** The controls of the clip and its time. */
  const timing = (current: api.Clip) => {
    const steps = (by: number) => () => {
      const times = by > 0 ? current.frames : [...current.frames].reverse();
      const next = times.find((t) => by * (t - time) > 1e-4);
      if (next === undefined) return;
      time = next;
      view.pose(clip, time);
      draw();
    };
    return [
      choice(
        "Clip",
        clip,
        clips.map((c) => [c.name, c.name]),
        (v) => {
          clip = v;
          time = 0;
          view.pose(clip, time);
          draw();
        },
      ),
      slider(
        "Time",
        time,
        { min: 0, max: current.duration_s, step: current.duration_s / 1000 || 1 },
        (v) => {
          time = v;
          view.pose(clip, time);
        },
        (v) => `${v.toFixed(3)} s`,
        "pose-time",
      ),
      h("div", { className: "row two" }, button("Pose before", steps(-1)), button("Pose after", steps(1))),
    ];
  };

  const draw = () => {
    const { pose } = store.opened.settings.poses;
    const missing = all.filter((k) => !pose.some((p) => p.key === k.key));
    const current = clips.find((c) => c.name === clip);
    const told =
      missing.length === 0
        ? "Every key has a pose."
        : `Poses are missing for: key ${missing.map((k) => k.key).join(", ")}.`;
    fill(
      inspector,
      h("h2", {}, "Poses"),
      h(
        "p",
        { className: "lead" },
        rigPath()
          ? "Find the moment of a clip that looks like the key image and assign it to the key."
          : "Choose the rig that holds your key poses.",
      ),
      rigPath() ? h("p", { className: "facts" }, `Rig: ${rigPath()}`) : null,
      button(rigPath() ? "Another rig" : "Choose a rig", chooseRig, { id: "rig", className: rigPath() ? "" : "main" }),
      ...(current ? timing(current) : []),
      all.length === 0 ? null : h("p", { id: "missing", className: missing.length === 0 ? "good" : "" }, told),
    );
  };
  draw();
  const refill = () =>
    renew().catch((error: unknown) => {
      draw();
      complain(error);
    });
  void refill();
  const ends = [store.on(["files"], () => void refill()), store.on(["frame"], () => markCurrent(sheet))];
  return () => {
    main.classList.remove("pair");
    ends.forEach((act) => act());
    viewer.end();
    view.end();
  };
}
