// Keys: the frames to be posed; move, add, drop and lock them, and see what error to expect.

import * as api from "./api";
import { keyFrames } from "./analysis";
import { button, checkbox, fill, h, labelled } from "./dom";
import { maskName, smallPictureUrl } from "./frames";
import { budget } from "./plots";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer } from "./viewer";

export interface Key {
  key: number;
  frame: number;
  time_s: number;
  partner_of: number | null;
}

const KEYS = "keys/keys.json";

/** The picture of a key, its silhouette over it. */
export function keyPicture(frame: number, width = 240): HTMLElement {
  const { shot, footage, files } = store.opened;
  const version = files[maskName(frame)];
  return h(
    "span",
    { className: footage ? "keypicture" : "keypicture bare" },
    footage ? h("img", { src: smallPictureUrl(frame, width), alt: `Footage, frame ${frame}` }) : null,
    version ? h("img", { src: api.fileUrl(shot, maskName(frame), version), alt: `Silhouette, frame ${frame}`, className: "mask" }) : null,
  );
}

/** Writes the keys as a person edited them: numbered on, partners after the keys. */
async function put(document: any, keys: Key[]): Promise<void> {
  const { shot, fps } = store.opened;
  const plain = keys.filter((k) => k.partner_of === null).sort((a, b) => a.frame - b.frame);
  const number = new Map(plain.map((k, at) => [k.key, at + 1]));
  const partners = keys.filter((k) => k.partner_of !== null && number.has(k.partner_of));
  const all = [...plain, ...partners].map((k, at) => ({
    key: at + 1,
    frame: k.frame,
    time_s: k.frame / fps,
    partner_of: k.partner_of === null ? null : number.get(k.partner_of)!,
  }));
  const text = JSON.stringify({ ...document, keys: all, proven_optimal: false });
  store.wrote(KEYS, await api.putFile(shot, KEYS, text, store.version(KEYS)));
}

export function keys(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const sheet = h("div", { className: "sheet", tabIndex: 0, role: "region", "aria-label": "Key images" });
  main.classList.add("split");
  main.append(viewer.canvas, sheet);
  let document: any = null;
  let shown = "";

  const edit = (change: (keys: Key[]) => Key[]) => attempt(() => put(document, change(document.keys)));
  const taken = (frame: number) => document.keys.some((k: Key) => k.frame === frame);

  const card = (k: Key) => {
    const { include } = store.opened.settings.keys;
    const locked = include.includes(k.frame);
    const partner = k.partner_of !== null;
    return h(
      "article",
      { className: "key" },
      h("button", { type: "button", className: "show", "aria-label": `Show key ${k.key}, frame ${k.frame}`, onclick: () => store.setFrame(k.frame) }, keyPicture(k.frame)),
      h("p", {}, h("strong", {}, `Key ${k.key}`), ` frame ${k.frame}`, partner ? `, partner of key ${k.partner_of}` : ""),
      h(
        "div",
        { className: "row" },
        button("Move to current", () => {
          if (taken(store.frame)) return say(`Frame ${store.frame} is a key already.`);
          edit((all) => all.map((other) => (other.key === k.key ? { ...other, frame: store.frame } : other)));
        }),
        button("Drop", () => edit((all) => all.filter((other) => other.key !== k.key && other.partner_of !== k.key))),
        partner
          ? null
          : button(locked ? "Unlock" : "Lock", () =>
              attempt(() => store.change({ "keys.include": locked ? include.filter((f) => f !== k.frame) : [...include, k.frame] })),
            { "aria-pressed": String(locked) }),
      ),
    );
  };

  const renew = async () => {
    const { files, shot, settings } = store.opened;
    const now = `${files[KEYS] ?? ""} ${settings.keys.include.join()}`;
    if (now === shown) return;
    shown = now;
    if (!files[KEYS]) return;
    document = JSON.parse(await api.text(shot, KEYS));
    sheet.replaceChildren(...(document.keys as Key[]).map(card));
    draw();
  };

  const draw = () => {
    const { settings } = store.opened;
    const count = h("input", { type: "number", min: "2", max: "24", value: String(settings.keys.count) });
    count.addEventListener("change", () => attempt(() => store.change({ "keys.count": Number(count.value) })));
    const lines = document?.budget ?? [];
    fill(
      inspector,
      h("h2", {}, "Keys"),
      h("p", {}, "The fewest images that tell the motion. Pose your rig for each of them."),
      labelled("Number of keys", count),
      checkbox("Partners: the same silhouette in the other half of the stride", settings.keys.partners, (v) => attempt(() => store.change({ "keys.partners": v }))),
      button("Choose keys", () => attempt(async () => {
        const chosen = await store.run("keys");
        say(`${chosen?.keys?.length ?? 0} keys are chosen.`);
      }), { className: "main", id: "choose", disabled: store.job !== null || !store.version("masks/000000.png") }),
      button("Add the current frame", () => {
        if (taken(store.frame)) return say(`Frame ${store.frame} is a key already.`);
        edit((all) => [...all, { key: 1000, frame: store.frame, time_s: 0, partner_of: null }]);
      }, { disabled: document === null }),
      document?.next_frame !== null && document?.next_frame !== undefined
        ? h("p", {}, `Posing frame ${document.next_frame} next would help most. `, button("Show it", () => store.setFrame(document.next_frame), { className: "quiet" }))
        : null,
      lines.length > 1 ? h("h3", {}, "Expected error") : null,
      lines.length > 1 ? budget(lines) : null,
    );
  };
  draw();
  attempt(renew);
  const ends = [store.on(["files"], () => attempt(renew)), store.on(["job"], draw)];
  return () => {
    main.classList.remove("split");
    ends.forEach((act) => act());
    viewer.end();
  };
}

export { keyFrames };
