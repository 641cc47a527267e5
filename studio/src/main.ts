// The window: steps at the left, the picture, what can be done at the right, frames at the bottom.

import "./style.css";

import * as api from "./api";
import { analysis } from "./analysis";
import { button, h } from "./dom";
import { footage } from "./footage";
import { keys } from "./keys";
import { paint } from "./paint";
import { poses } from "./poses";
import { result } from "./result";
import { attempt, quieten } from "./say";
import { scrubber } from "./scrubber";
import { STEPS, listenToKeys, showShortcuts } from "./shortcuts";
import { start } from "./start";
import { store, type Step } from "./store";

type Room = (main: HTMLElement, inspector: HTMLElement) => () => void;

const ROOMS: Record<Step, Room> = { footage, paint, analysis, keys, poses, result };

/** The stage whose state a step shows. */
const STAGE_OF: Partial<Record<Step, string>> = {
  footage: "segment",
  analysis: "analyze",
  keys: "keys",
  result: "animate",
};

const WORDS: Record<string, string> = {
  fresh: "done",
  stale: "out of date",
  missing: "to do",
};

function posesSaid(): string {
  const { length } = store.opened.settings.poses.pose;
  return length === 1 ? "1 pose" : length > 0 ? `${length} poses` : "to do";
}

const app = document.querySelector<HTMLElement>("#app")!;
let leave: (() => void) | null = null;
let go: (step: Step) => void = () => undefined;

function workspace(): void {
  const main = h("main", { className: "stage", "aria-label": "Picture" });
  const inspector = h("aside", { className: "inspector", "aria-label": "What can be done" });
  const rail = h("nav", { className: "rail", "aria-label": "Steps" });
  const progress = h("div", { className: "progress" });
  go = (step) => {
    leave?.();
    if (store.step !== step) quieten();
    store.step = step;
    main.className = "stage";
    main.replaceChildren();
    inspector.replaceChildren();
    leave = ROOMS[step](main, inspector);
    draw();
  };
  const draw = () => {
    const shot = store.shot;
    if (!shot) return;
    document.title = `${shot.name}, Muybridge studio`;
    const focused = document.activeElement?.id ?? "";
    rail.replaceChildren(
      button(shot.name, leaveShot, {
        className: "shot",
        title: "Another shot",
        "aria-label": `Shot ${shot.name}; choose another`,
      }),
      ...STEPS.map(([step, name], at) => {
        const stage = STAGE_OF[step];
        const state = stage ? (shot.stages[stage]?.state ?? "missing") : "";
        const words = step === "poses" ? posesSaid() : (WORDS[state] ?? "");
        return h(
          "button",
          {
            type: "button",
            id: `step-${step}`,
            className: `step ${state}`,
            onclick: () => go(step),
            "aria-current": store.step === step ? "step" : undefined,
          },
          h("span", { className: "number", "aria-hidden": "true" }, String(at + 1)),
          h("span", {}, name, words ? h("small", {}, words) : null),
        );
      }),
      button("?", showShortcuts, { className: "quiet help", "aria-label": "Keyboard shortcuts" }),
    );
    if (focused.startsWith("step-")) document.getElementById(focused)?.focus();
  };
  const work = () => {
    const job = store.job;
    progress.replaceChildren(
      ...(job
        ? [
            h("span", {}, `${job.stage} ${job.total ? `${job.done} of ${job.total}` : "…"}`),
            h("progress", {
              "aria-label": `Progress of ${job.stage}`,
              ...(job.total ? { max: job.total, value: job.done } : {}),
            }),
            button("Stop", () => attempt(() => api.cancel(job.job)), { className: "quiet" }),
          ]
        : []),
    );
  };
  const line = h("div", { className: "outage", role: "alert" });
  const heard = () => {
    line.textContent = store.connected
      ? ""
      : "The studio does not answer. Start it again with muybridge studio; what is drawn here is saved when it is back.";
  };
  const strip = scrubber();
  const ends = [store.on(["files", "shot"], draw), store.on(["job"], work), store.on(["line"], heard), strip.end];
  const leaveShot = () => {
    leave?.();
    leave = null;
    ends.forEach((act) => act());
    store.close();
    history.replaceState(null, "", "#");
    start(app, workspace);
  };
  app.replaceChildren(h("div", { className: "workspace" }, rail, main, inspector, strip.element, progress, line));
  go("footage");
  work();
}

listenToKeys((step) => go(step));
attempt(async () => {
  const session = await api.session();
  store.rootName = session.root;
  const named = decodeURIComponent(location.hash.slice(1)) || session.shot;
  if (named) {
    try {
      await store.open(named);
      return workspace();
    } catch {
      history.replaceState(null, "", "#");
    }
  }
  start(app, workspace);
});
