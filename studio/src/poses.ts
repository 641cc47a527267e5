// Poses: the rig, its clips in 3D, and which of its poses belongs to which key.

import * as api from "./api";
import { keyPicture, type Key } from "./keys";
import { keyFrames } from "./analysis";
import { browser } from "./browser";
import { button, choice, fill, h } from "./dom";
import { RigView } from "./rigview";
import { attempt, complain, say } from "./say";
import { store } from "./store";

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
  const sheet = h("div", { className: "sheet", tabIndex: 0, role: "region", "aria-label": "Poses of the keys" });
  main.classList.add("split");
  main.append(view.canvas, sheet);
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
    const pose = store.opened.settings.poses.pose.filter((p) => p.key !== key);
    pose.push({ key, clip, time: Number(time.toFixed(4)) });
    pose.sort((a, b) => a.key - b.key);
    attempt(() => store.change({ "poses.pose": pose }));
  };

  const card = (k: Key) => {
    const pose = store.opened.settings.poses.pose.find((p) => p.key === k.key);
    return h(
      "article",
      { className: pose ? "key" : "key missing" },
      h("button", { type: "button", className: "show", "aria-label": `Show frame ${k.frame}`, onclick: () => store.setFrame(k.frame) }, keyPicture(k.frame)),
      h("p", {}, h("strong", {}, `Key ${k.key}`), ` frame ${k.frame}`),
      h("p", {}, pose ? `${pose.clip}, ${timeOf(pose).toFixed(3)} s` : "no pose yet"),
      h(
        "div",
        { className: "row" },
        button("Assign this pose", () => assign(k.key), { disabled: clip === "", "data-assign": String(k.key) }),
        pose
          ? button("Show", () => {
              clip = pose.clip;
              time = timeOf(pose);
              draw();
              view.pose(clip, time);
            })
          : null,
      ),
    );
  };

  const renew = async () => {
    const rig = rigPath();
    const { files, settings } = store.opened;
    const now = JSON.stringify([rig, files["keys/keys.json"], settings.poses]);
    if (now === shown) return;
    shown = now;
    all = await keyFrames() as Key[];
    if (rig && rig !== loaded) {
      loaded = rig;
      clips = (await api.rigClips(rig)).clips;
      clip = clips[0]?.name ?? "";
      time = 0;
      const folder = rig.includes("/") ? rig.slice(0, rig.lastIndexOf("/") + 1) : "";
      await view.load(api.rigUrl(rig), (name) => api.rigUrl(folder + decodeURIComponent(name)));
      view.pose(clip, time);
    }
    sheet.replaceChildren(...all.map(card));
    draw();
  };

  const draw = () => {
    const { pose } = store.opened.settings.poses;
    const missing = all.filter((k) => !pose.some((p) => p.key === k.key));
    const current = clips.find((c) => c.name === clip);
    const slide = h("input", { type: "range", min: "0", max: String(current?.duration_s ?? 1), step: "any", id: "pose-time" });
    slide.value = String(time);
    const label = h("label", { htmlFor: "pose-time" }, `Time, ${time.toFixed(3)} s`);
    slide.addEventListener("input", () => {
      time = Number(slide.value);
      label.textContent = `Time, ${time.toFixed(3)} s`;
      view.pose(clip, time);
    });
    const step = (by: number) => {
      const times = current?.frames ?? [];
      const next = by > 0 ? times.find((t) => t > time + 1e-4) : [...times].reverse().find((t) => t < time - 1e-4);
      if (next === undefined) return;
      time = next;
      view.pose(clip, time);
      draw();
    };
    fill(
      inspector,
      h("h2", {}, "Poses"),
      h("p", {}, rigPath() ? `Rig: ${rigPath()}` : "Choose the rig that holds your key poses."),
      button(rigPath() ? "Another rig" : "Choose a rig", () =>
        browser("Choose a rig (glTF or GLB)", ["rig"], (entry) => attempt(async () => {
          await store.change({}, entry.path);
          say(`${entry.name} is the rig now.`);
        })), { id: "rig" }),
      ...(current
        ? [
            choice("Clip", clip, clips.map((c) => [c.name, c.name]), (v) => {
              clip = v;
              time = 0;
              view.pose(clip, time);
              draw();
            }),
            h("div", { className: "field" }, label, slide),
            h("div", { className: "row" }, button("Key before", () => step(-1)), button("Key after", () => step(1)), button("Side view", () => view.side())),
          ]
        : []),
      all.length === 0
        ? h("p", { className: "hint" }, "There are no keys yet.")
        : h("p", { id: "missing" }, missing.length === 0 ? "Every key has a pose." : `Poses are missing for: key ${missing.map((k) => k.key).join(", ")}.`),
    );
  };
  draw();
  const refill = () => renew().catch((error: unknown) => { draw(); complain(error); });
  void refill();
  const ends = [store.on(["files"], () => void refill())];
  return () => {
    main.classList.remove("split");
    ends.forEach((act) => act());
    view.end();
  };
}
