// What the page knows: the shot as the program last told it, and where the user is in it.

import * as api from "./api";
import type { ShotState } from "./api";

export type Step = "footage" | "paint" | "analysis" | "keys" | "poses" | "result";
export type Topic = "shot" | "frame" | "step" | "view" | "job" | "files";

export interface View {
  maskOpacity: number;
  onion: boolean;
  dim: number;
}

class Store {
  shot: ShotState | null = null;
  rootName = "";
  frame = 0;
  step: Step = "footage";
  view: View = { maskOpacity: 0.45, onion: false, dim: 0 };
  job: { stage: string; id: string; done: number; total: number | null } | null = null;
  private heard = new Map<Topic, Set<() => void>>();
  private stop: (() => void) | null = null;

  /** Calls `act` whenever one of the topics changes; the function returned ends that. */
  on(topics: Topic[], act: () => void): () => void {
    for (const topic of topics) {
      if (!this.heard.has(topic)) this.heard.set(topic, new Set());
      this.heard.get(topic)!.add(act);
    }
    return () => topics.forEach((topic) => this.heard.get(topic)?.delete(act));
  }

  tell(topic: Topic): void {
    for (const act of [...(this.heard.get(topic) ?? [])]) act();
  }

  get opened(): ShotState {
    if (!this.shot) throw new Error("no shot is open");
    return this.shot;
  }

  async open(shot: string): Promise<void> {
    this.stop?.();
    this.shot = await api.shotState(shot);
    this.frame = 0;
    this.job = null;
    history.replaceState(null, "", `#${encodeURIComponent(shot)}`);
    this.stop = api.listen(shot, (name, data) => this.hear(name, data));
    this.tell("shot");
  }

  setFrame(frame: number): void {
    const last = Math.max(0, (this.shot?.frames ?? 1) - 1);
    const next = Math.min(last, Math.max(0, Math.round(frame)));
    if (next === this.frame) return;
    this.frame = next;
    this.tell("frame");
  }

  setView(view: Partial<View>): void {
    this.view = { ...this.view, ...view };
    this.tell("view");
  }

  version(name: string): string {
    return this.shot?.files[name] ?? "";
  }

  /** Notes the version of a file that this page has just written. */
  wrote(name: string, version: string): void {
    if (!this.shot) return;
    if (version) this.shot.files[name] = version;
    else delete this.shot.files[name];
    this.tell("files");
  }

  async refresh(): Promise<void> {
    if (!this.shot) return;
    const name = this.shot.shot;
    const state = await api.shotState(name);
    if (this.shot?.shot !== name) return;
    this.shot = state;
    this.frame = Math.min(this.frame, Math.max(0, state.frames - 1));
    this.tell("files");
  }

  /** Changes settings; when another tab did meanwhile, once more on what it left. */
  async change(set: Record<string, unknown>, rig?: string): Promise<void> {
    const { shot, settings_version } = this.opened;
    try {
      this.shot = await api.changeSettings(shot, settings_version, set, rig);
    } catch (error) {
      if (!(error instanceof api.Refused && error.status === 409 && error.version)) throw error;
      this.shot = await api.changeSettings(shot, error.version, set, rig);
    }
    this.tell("files");
  }

  private finished: ((outcome: { result?: any; error?: string; hint?: string }) => void)[] = [];

  /** Runs a stage and waits for its end; the document the command would print. */
  async run(stage: string): Promise<any> {
    const ended = new Promise<any>((resolve, reject) => {
      this.finished.push((outcome) => {
        if (outcome.error) reject(new api.Refused(422, outcome.error, outcome.hint ?? null, null));
        else resolve(outcome.result);
      });
    });
    try {
      const { job } = await api.run(this.opened.shot, stage);
      this.job = { stage, id: job, done: 0, total: null };
      this.tell("job");
    } catch (error) {
      this.finished.pop();
      throw error;
    }
    return ended;
  }

  private hear(name: string, data: any): void {
    if (name === "progress") {
      this.job = { stage: data.stage, id: data.job, done: data.done, total: data.total };
      this.tell("job");
    } else if (name === "done" || name === "failed" || name === "cancelled") {
      this.job = null;
      this.tell("job");
      const outcome =
        name === "done"
          ? { result: data.result }
          : { error: data.error ?? "stopped", hint: data.hint ?? undefined };
      void this.refresh().finally(() => {
        for (const act of this.finished.splice(0)) act(outcome);
      });
    } else if (name === "changed") {
      const files = (data?.files ?? {}) as Record<string, string>;
      const ours = Object.entries(files).every(([file, v]) => this.version(file) === v);
      if (!ours || Object.keys(files).length === 0) void this.refresh();
    }
  }
}

export const store = new Store();
