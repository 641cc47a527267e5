// Footage: look at it, draw the two rectangles, find the silhouettes.

import type { Rectangle } from "./api";
import { button, checkbox, fill, h, slider } from "./dom";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer, type Tool } from "./viewer";

type Side = "foreground" | "background";

const COLOURS: Record<Side, string> = { foreground: "#4ade80", background: "#f87171" };

/** Draws and changes the two rectangles on the first frame. */
class Rectangles implements Tool {
  side: Side = "foreground";
  cursor = "crosshair";
  private start: [number, number] | null = null;
  private drawn: Rectangle | null = null;

  constructor(private readonly redraw: () => void) {}

  down(x: number, y: number): void {
    if (store.frame !== 0) {
      say("The rectangles belong to the first frame; it is shown now.");
      store.setFrame(0);
      return;
    }
    this.start = [x, y];
  }

  move(x: number, y: number): void {
    if (!this.start) return;
    const { width, height } = store.opened;
    const inside = (v: number, most: number) => Math.round(Math.min(most, Math.max(0, v)));
    const [x0, x1] = [this.start[0], x].map((v) => inside(v, width)).sort((a, b) => a - b);
    const [y0, y1] = [this.start[1], y].map((v) => inside(v, height)).sort((a, b) => a - b);
    this.drawn = [x0!, y0!, x1! - x0!, y1! - y0!];
    this.redraw();
  }

  up(): void {
    const drawn = this.drawn;
    this.start = null;
    this.drawn = null;
    if (!drawn || drawn[2] < 2 || drawn[3] < 2) return this.redraw();
    const side = this.side;
    attempt(async () => {
      await store.change({ [`source.${side}`]: drawn });
      if (side === "foreground" && !store.opened.settings.source.background) {
        this.side = "background";
        store.tell("view");
      }
    });
  }

  paint(context: CanvasRenderingContext2D, scale: number): void {
    if (store.frame !== 0) return;
    for (const side of ["foreground", "background"] as const) {
      const own = this.side === side ? this.drawn : null;
      const r = own ?? store.opened.settings.source[side];
      if (!r) continue;
      context.lineWidth = 2 / scale;
      context.strokeStyle = COLOURS[side];
      context.setLineDash(side === "background" ? [8 / scale, 5 / scale] : []);
      context.strokeRect(...r);
      context.setLineDash([]);
      context.font = `600 ${13 / scale}px system-ui`;
      context.fillStyle = COLOURS[side];
      const text = side === "foreground" ? "animal" : "background";
      context.fillText(text, r[0] + 5 / scale, r[1] + 16 / scale);
    }
  }
}

export function footage(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const tool = new Rectangles(viewer.redraw);
  viewer.tool = tool;
  main.append(viewer.canvas);

  const draw = () => {
    const { source } = store.opened.settings;
    const has = store.opened.footage;
    const side = (name: Side, text: string) =>
      button(text, () => ((tool.side = name), draw()), {
        "aria-pressed": String(tool.side === name),
        className: `side ${name}`,
      });
    const told = (r: Rectangle | null) => (r ? r.join(", ") : "not drawn yet");
    const missing = !source.foreground || !source.background;
    fill(
      inspector,
      h("h2", {}, "Footage"),
      h("p", { className: "facts" }, facts()),
      store.opened.footage_problem
        ? h("p", { className: "fault" }, store.opened.footage_problem)
        : null,
      ...(has
        ? [
            h("h3", {}, "Two rectangles on the first frame"),
            h("p", {}, "Drag one inside the animal and one where it is not."),
            h("div", { className: "row" }, side("foreground", "Animal"), side("background", "Background")),
            h(
              "dl",
              {},
              h("dt", {}, "Animal"),
              h("dd", {}, told(source.foreground)),
              h("dt", {}, "Background"),
              h("dd", {}, told(source.background)),
            ),
          ]
        : []),
      button("Find silhouettes", () => attempt(segment), {
        className: "main",
        id: "segment",
        disabled: store.job !== null || (has && missing && !hasStrokes()),
      }),
      has && missing
        ? h("p", { className: "hint" }, "Without rectangles, sketch every frame under Paint instead.")
        : null,
      h("h3", {}, "View"),
      slider("Mask", store.view.maskOpacity, { min: 0, max: 1, step: 0.05 }, (v) =>
        store.setView({ maskOpacity: v }),
      ),
      checkbox("Onion skin: masks before (red) and after (blue)", store.view.onion, (v) =>
        store.setView({ onion: v }),
      ),
    );
  };
  draw();
  const ends = [store.on(["files", "job", "shot"], draw)];
  return () => {
    viewer.end();
    ends.forEach((act) => act());
  };
}

function hasStrokes(): boolean {
  return Object.keys(store.opened.files).some((name) => name.startsWith("strokes/"));
}

function facts(): string {
  const { width, height, frames, fps } = store.opened;
  return `${width} × ${height} pixels, ${frames} frames, ${Number(fps.toFixed(3))} a second`;
}

export async function segment(): Promise<void> {
  const result = await store.run("segment");
  const flagged: number = new Set((result?.flagged ?? []).flatMap((f: any) => f.frames)).size;
  const made = result?.made === undefined ? "" : `${result.made} of ${result.frames} masks made. `;
  const next = result?.correct_next ?? null;
  const hint = next === null ? null : `The least sure frame is ${next}; a stroke there helps most.`;
  say(`${made}${flagged} frames are flagged.`, hint);
}
