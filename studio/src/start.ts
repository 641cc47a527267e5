// The first screen: open a shot, or make one.

import * as api from "./api";
import { browser } from "./browser";
import { button, checkbox, h, labelled } from "./dom";
import { attempt } from "./say";
import { store } from "./store";

export function start(root: HTMLElement, opened: () => void): void {
  const open = (shot: string) => attempt(async () => {
    await store.open(shot);
    opened();
  });
  const text = (value: string, more: object = {}) => h("input", { type: "text", value, ...more });
  const from = text("", { id: "from", placeholder: "a clip, a folder of pictures, or synthetic:gallop" });
  const shot = text("", { id: "shot-name", placeholder: "a name for the new folder" });
  const fps = h("input", { type: "number", min: "1", step: "any", id: "fps", placeholder: "as in the clip" });
  const range = text("", { id: "range", placeholder: "all, or 0-99" });
  let kind: "from" | "strokes" | "mattes" = "from";
  const take = (entry: api.Entry) => {
    from.value = entry.path;
    if (!shot.value) shot.value = entry.name.replace(/\.[^.]*$/, "").replace(/[^\w-]+/g, "_");
  };
  const make = () => attempt(async () => {
    await api.makeShot({
      shot: shot.value.trim(),
      [kind]: from.value.trim(),
      ...(fps.value ? { fps: Number(fps.value) } : {}),
      ...(range.value ? { frames: range.value.trim() } : {}),
    });
    await store.open(shot.value.trim());
    opened();
  });
  root.replaceChildren(
    h(
      "main",
      { className: "start" },
      h("h1", {}, "Muybridge"),
      h("p", {}, `Footage of an animal to animation on your rig. Files are looked for in «${store.rootName}».`),
      h(
        "section",
        { "aria-label": "Open a shot" },
        h("h2", {}, "Open a shot"),
        button("Choose a shot", () => browser("Open a shot", ["shot"], (entry) => open(entry.path)), { id: "open", className: "main" }),
      ),
      h(
        "form",
        { "aria-label": "A new shot", onsubmit: (event: Event) => { event.preventDefault(); make(); } },
        h("h2", {}, "A new shot"),
        labelled("From", from),
        h("div", { className: "row" }, button("Choose a clip or folder", () => browser("Footage", ["video", "images"], take), { id: "choose-source" })),
        checkbox("These are ready mattes", false, (v) => (kind = v ? "mattes" : "from")),
        labelled("Name", shot),
        h("div", { className: "row" }, labelled("Frames a second", fps), labelled("Frames", range)),
        h("button", { type: "submit", className: "main", id: "make" }, "Make the shot"),
      ),
    ),
  );
}
