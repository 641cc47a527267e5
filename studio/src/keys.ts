// Keys: the frames to be posed; move, add, drop and lock them, and see what error to expect.

import * as api from "./api";
import type { Key, Keys } from "./documents";
import { button, checkbox, fill, h, labelled, percent } from "./dom";
import { maskName, smallPictureUrl } from "./frames";
import { editKeys, keysVersion, NEW, readKeys } from "./keyfile";
import { budget } from "./plots";
import { attempt, offer, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

/** The picture of a key, its silhouette over it. */
export function keyPicture(frame: number, width = 320): HTMLElement {
  const { shot, footage, files } = store.opened;
  const version = files[maskName(frame)];
  return h(
    "span",
    { className: footage ? "keypicture" : "keypicture bare" },
    footage ? h("img", { src: smallPictureUrl(frame, width), alt: `Footage, frame ${frame}` }) : null,
    version
      ? h("img", {
          src: api.fileUrl(shot, maskName(frame), version),
          alt: `Silhouette, frame ${frame}`,
          className: "mask",
        })
      : null,
  );
}

/** Marks the cards of the frame that is shown. */
export function markCurrent(sheet: HTMLElement): void {
  for (const card of sheet.querySelectorAll<HTMLElement>("[data-frame]")) {
    card.classList.toggle("current", card.dataset["frame"] === String(store.frame));
  }
}

async function choose(force = false): Promise<void> {
  const { result, kept, ran } = await store.run<Keys>("keys", { force });
  if (kept.length > 0) {
    return offer(
      "Your own keys are kept.",
      "They were changed by hand, so they are not chosen anew unless you say so.",
      {
        label: "Choose anew, mine are lost",
        act: () => attempt(() => choose(true)),
      },
    );
  }
  const partners = result.keys.filter((k) => k.partner_of !== null).length;
  const told = `${result.keys.length - partners} keys${partners > 0 ? ` and ${partners} partners` : ""} are chosen.`;
  say(ran ? told : "The keys are up to date.");
}

/** Frames that stay keys whenever keys are chosen. */
const lock = (frame: number, on: boolean) =>
  store.change(({ keys }) => ({
    "keys.include": on
      ? [...new Set([...keys.include, frame])].sort((a, b) => a - b)
      : keys.include.filter((f) => f !== frame),
  }));

/** The frame that stays the partner of a key whenever keys are chosen. */
const keepPartner = (key: number, frame: number | null) =>
  store.change(({ keys }) => ({
    "keys.partner_of": [...keys.partner_of.filter(([k]) => k !== key), ...(frame === null ? [] : [[key, frame]])].sort(
      ([a], [b]) => a! - b!,
    ),
  }));

async function move(key: Key, frame: number): Promise<void> {
  const { include, partner_of } = store.opened.settings.keys;
  await editKeys((all) => all.map((k) => (k.key === key.key ? { ...k, frame } : k)));
  if (key.partner_of === null && include.includes(key.frame)) {
    await lock(key.frame, false);
    await lock(frame, true);
  }
  if (key.partner_of !== null && partner_of.some(([k]) => k === key.partner_of))
    await keepPartner(key.partner_of, frame);
}

/** Takes a key away with its partner; what was dropped is held no more. */
async function drop(key: Key): Promise<void> {
  if (key.partner_of === null) await lock(key.frame, false);
  await keepPartner(key.partner_of ?? key.key, null);
  await editKeys((all) => all.filter((k) => k.key !== key.key && k.partner_of !== key.key));
}

export function keys(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const sheet = h("div", { className: "sheet", tabIndex: 0, role: "region", "aria-label": "Key images" });
  main.classList.add("split");
  main.append(viewer.element, sheet);
  let document: Keys | null = null;
  let shown = "";

  const taken = (frame: number) => {
    const is = document?.keys.some((k) => k.frame === frame) ?? false;
    if (is) say(`Frame ${frame} is a key already.`);
    return is;
  };

  const card = (k: Key) => {
    const { include, partner_of } = store.opened.settings.keys;
    const owner = k.partner_of;
    const held =
      owner === null ? include.includes(k.frame) : partner_of.some(([key, f]) => key === owner && f === k.frame);
    const hold = () =>
      attempt(() => (owner === null ? lock(k.frame, !held) : keepPartner(owner, held ? null : k.frame)));
    const words = owner === null ? (held ? "Unlock" : "Lock") : held ? "Accepted" : "Accept";
    return h(
      "article",
      { className: held ? "key held" : "key", "data-frame": String(k.frame) },
      h(
        "button",
        {
          type: "button",
          className: "show",
          "aria-label": `Show key ${k.key}, frame ${k.frame}`,
          onclick: () => store.setFrame(k.frame),
        },
        keyPicture(k.frame),
      ),
      h(
        "p",
        {},
        h("strong", {}, owner === null ? `Key ${k.key}` : `Partner of key ${owner}`),
        h("span", { className: "hint" }, `frame ${k.frame}`),
      ),
      h(
        "div",
        { className: "row" },
        button(
          owner === null ? "Move here" : "Change to here",
          () => taken(store.frame) || attempt(() => move(k, store.frame)),
          { title: "Move it to the frame that is shown" },
        ),
        button(words, hold, { "aria-pressed": String(held), title: "Held when keys are chosen again" }),
        button("Drop", () => attempt(() => drop(k))),
      ),
    );
  };

  const renew = async () => {
    const { include, partner_of } = store.opened.settings.keys;
    const now = JSON.stringify([keysVersion(), include, partner_of]);
    if (now !== shown) {
      shown = now;
      document = await readKeys();
      fill(sheet, ...(document?.keys.map(card) ?? []));
      if (!document) fill(sheet, h("p", { className: "empty" }, "The keys come here when they are chosen."));
      markCurrent(sheet);
    }
    draw();
  };

  const draw = () => {
    const { settings } = store.opened;
    const count = h("input", { type: "number", min: "2", max: "24", value: String(settings.keys.count) });
    count.addEventListener("change", () => attempt(() => store.change(() => ({ "keys.count": Number(count.value) }))));
    const next = document?.next_frame ?? null;
    const lines = document?.budget ?? [];
    const error = document?.expected_error_share ?? null;
    fill(
      inspector,
      h("h2", {}, "Keys"),
      h("p", { className: "lead" }, "The fewest images that tell the motion. Pose your rig for each of them."),
      labelled("Number of keys", count),
      checkbox("Partners: the same silhouette in the other half of the stride", settings.keys.partners, (v) =>
        attempt(() => store.change(() => ({ "keys.partners": v }))),
      ),
      button("Choose keys", () => attempt(() => choose()), {
        className: "main",
        id: "choose",
        disabled: store.job !== null || !store.version("masks/000000.png"),
      }),
      button(
        "Add the current frame",
        () =>
          taken(store.frame) ||
          attempt(() => editKeys((all) => [...all, { key: NEW, frame: store.frame, time_s: 0, partner_of: null }])),
        {
          disabled: document === null,
          id: "add-key",
        },
      ),
      error === null ? null : h("p", {}, `With these poses an error of ${percent(error)} of the motion is expected.`),
      document?.mirrored
        ? h("p", {}, "Each pose is used half a stride later too, with left and right exchanged.")
        : null,
      next === null
        ? null
        : h(
            "p",
            {},
            `Posing frame ${next} next would help most. `,
            button("Show it", () => store.setFrame(next), { className: "quiet inline" }),
          ),
      lines.length > 1 ? h("h3", {}, "Expected error by number of poses") : null,
      lines.length > 1 ? budget(lines, document?.keys.length ?? 0) : null,
    );
  };
  draw();
  const again = () => attempt(renew);
  again();
  const ends = [store.on(["files"], again), store.on(["job"], draw), store.on(["frame"], () => markCurrent(sheet))];
  return () => {
    main.classList.remove("split");
    ends.forEach((act) => act());
    viewer.end();
  };
}
