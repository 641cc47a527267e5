// Choosing a file or folder below the folder the studio was started in.

import * as api from "./api";
import { button, h } from "./dom";
import { complain } from "./say";

const WORDS: Record<api.Entry["kind"], string> = {
  folder: "folder",
  shot: "shot",
  video: "video",
  images: "pictures",
  rig: "rig",
  file: "file",
};

/** Asks for an entry of one of the kinds; folders are walked through. */
export function browser(title: string, kinds: api.Entry["kind"][], chosen: (entry: api.Entry) => void): void {
  const list = h("ul", { className: "entries" });
  const where = h("p", { className: "hint" });
  const dialog = h(
    "dialog",
    { "aria-label": title },
    h("h2", {}, title),
    where,
    list,
    h(
      "div",
      { className: "row" },
      button("Cancel", () => dialog.close()),
    ),
  );
  dialog.addEventListener("close", () => dialog.remove());
  const show = async (path: string) => {
    const found = await api.browse(path);
    where.textContent = `/${found.path}`;
    const up =
      found.parent === null
        ? []
        : [button("..", () => void show(found.parent!).catch(complain), { "aria-label": "The folder above" })];
    const lines = found.entries.flatMap((entry) => {
      const wanted = kinds.includes(entry.kind);
      const walks = ["folder", "images", "shot"].includes(entry.kind);
      if (!wanted && !walks) return [];
      const count = entry.count === null ? "" : `, ${entry.count}`;
      const act = wanted
        ? () => {
            dialog.close();
            chosen(entry);
          }
        : () => void show(entry.path).catch(complain);
      const own = [button(entry.name, act), h("span", { className: "hint" }, WORDS[entry.kind] + count)];
      if (wanted && walks)
        own.push(button("Open folder", () => void show(entry.path).catch(complain), { className: "quiet" }));
      return [h("li", {}, ...own)];
    });
    list.replaceChildren(...up.map((b) => h("li", {}, b)), ...lines);
  };
  document.body.append(dialog);
  dialog.showModal();
  void show("").catch(complain);
}
