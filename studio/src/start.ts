// The first screen: open a shot, or make one.

import * as api from "./api";
import { browser } from "./browser";
import { button, choice, h, labelled } from "./dom";
import { attempt } from "./say";
import { showShortcuts } from "./shortcuts";
import { store } from "./store";

type Kind = "from" | "mattes" | "strokes";

const KINDS: [Kind, string][] = [
  ["from", "footage: find the animal in it, or sketch over it"],
  ["mattes", "ready mattes from a roto tool"],
  ["strokes", "sketches, white strokes on black"],
];

/** A built-in animal to try the studio on. */
const SAMPLE = "synthetic:gallop";

/** Shots of the folder that are offered at once. */
const MOST_SHOTS = 24;

export function start(root: HTMLElement, opened: () => void): void {
  document.title = "Muybridge studio";
  const open = (shot: string) =>
    attempt(async () => {
      await store.open(shot);
      opened();
    });
  const text = (value: string, more: object = {}) => h("input", { type: "text", value, autocomplete: "off", ...more });
  const from = text("", { id: "from", placeholder: "a clip or a folder of pictures" });
  const shot = text("", { id: "shot-name", placeholder: "a name for the new folder" });
  const fps = h("input", { type: "number", min: "1", step: "any", id: "fps", placeholder: "as in the clip" });
  const range = text("", { id: "range", placeholder: "all, or 0-99" });
  const near = h("div", { className: "row shots" });
  attempt(async () => {
    const shots = (await api.browse("")).entries.filter((entry) => entry.kind === "shot").slice(0, MOST_SHOTS);
    near.replaceChildren(...shots.map((entry) => button(entry.name, () => open(entry.path))));
  });
  let kind: Kind = "from";
  const name = (path: string) => {
    if (!shot.value) shot.value = path.replace(/\.[^.]*$/, "").replace(/[^\w-]+/g, "_");
  };
  const take = (entry: api.Entry) => {
    from.value = entry.path;
    name(entry.name);
  };
  const sample = () => {
    from.value = SAMPLE;
    name("gallop");
  };
  const make = () =>
    attempt(async () => {
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
      h(
        "header",
        {},
        h("h1", {}, "Muybridge"),
        h("p", {}, "Footage of an animal becomes animation on your rig."),
        h("p", { className: "hint" }, `Shots, footage and rigs are looked for in the folder «${store.rootName}».`),
      ),
      h(
        "section",
        { "aria-label": "Open a shot" },
        h("h2", {}, "Open a shot"),
        near,
        button("Choose a shot elsewhere", () => browser("Open a shot", ["shot"], (entry) => open(entry.path)), {
          id: "open",
          className: "quiet",
        }),
      ),
      h(
        "form",
        {
          "aria-label": "A new shot",
          onsubmit: (event: Event) => {
            event.preventDefault();
            make();
          },
        },
        h("h2", {}, "A new shot"),
        choice("What you have", kind, KINDS, (v) => (kind = v as Kind)),
        labelled("From", from),
        h(
          "div",
          { className: "row" },
          button("Choose a clip or folder", () => browser("Footage", ["video", "images"], take), {
            id: "choose-source",
          }),
          button("Take the built-in horse", sample, { id: "sample", className: "quiet" }),
        ),
        labelled("Name", shot),
        h("div", { className: "row" }, labelled("Frames a second", fps), labelled("Frames", range)),
        h("button", { type: "submit", className: "main", id: "make" }, "Make the shot"),
      ),
      h(
        "p",
        {},
        button("Keyboard shortcuts", showShortcuts, { className: "quiet" }),
        button("Another browser", () => attempt(invite), { className: "quiet" }),
      ),
    ),
  );
}

/** Shows an address for another browser. */
async function invite(): Promise<void> {
  const { url } = await api.invitation();
  const address = h("input", { type: "text", value: url, readOnly: true, "aria-label": "Address" });
  const dialog = h(
    "dialog",
    { "aria-label": "Another browser" },
    h("h2", {}, "Another browser"),
    h("p", {}, "This address opens the studio once. Whoever has it can change your shots."),
    address,
    h(
      "div",
      { className: "row" },
      button("Close", () => dialog.close()),
    ),
  );
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  address.select();
}
