// What the page knows: the shot as the program last told it, and where the user is in it.

import * as api from "./api";
import type { Done, Events, Settings, ShotState } from "./api";

export type Step = "footage" | "paint" | "analysis" | "keys" | "poses" | "result";
export type Topic = "shot" | "frame" | "step" | "view" | "job" | "files" | "line";

export interface View {
  maskOpacity: number;
  onion: boolean;
  dim: number;
}

/** How often a change is tried again on what another tab has left meanwhile. */
const MOST_TRIES = 5;

type End = { done: Done } | { fault: api.Refused | api.Stopped };

class Store {
  shot: ShotState | null = null;
  rootName = "";
  frame = 0;
  step: Step = "footage";
  view: View = { maskOpacity: 0.45, onion: false, dim: 0 };
  job: api.JobStatus | null = null;
  /** Whether the program is heard. */
  connected = true;
  private heard = new Map<Topic, Set<() => void>>();
  private stop: (() => void) | null = null;
  /** Jobs of this tab that are waited for. */
  private waiting = new Map<string, (end: End) => void>();
  /** Ends that were told before the job's number had arrived: short jobs overtake it. */
  private ended = new Map<string, End>();
  private greetings = 0;
  /** Files this page has written, each with the number of the write. */
  private written = new Map<string, number>();
  private writes = 0;

  /** Calls `act` whenever one of the topics changes; the function returned ends that. */
  on(topics: Topic[], act: () => void): () => void {
    for (const topic of topics) {
      const acts = this.heard.get(topic) ?? new Set();
      this.heard.set(topic, acts.add(act));
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
    const state = await api.shotState(shot);
    this.close();
    this.shot = state;
    this.frame = 0;
    this.job = state.job;
    this.greetings = 0;
    this.written.clear();
    history.replaceState(null, "", `#${encodeURIComponent(shot)}`);
    this.stop = api.listen(shot, (name, data) => this.hear(name, data));
    this.tell("shot");
  }

  /** Leaves the shot. */
  close(): void {
    this.stop?.();
    this.stop = null;
    this.shot = null;
    this.job = null;
    this.connected = true;
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
    this.written.set(name, ++this.writes);
    this.tell("files");
  }

  async refresh(): Promise<void> {
    if (!this.shot) return;
    const { shot } = this.shot;
    const asked = this.writes;
    this.take(await api.shotState(shot), asked);
  }

  /** Takes up a state; what was written after it was asked for is newer than the answer. */
  private take(state: ShotState, asked: number): void {
    if (this.shot?.shot !== state.shot) return;
    for (const [file, at] of this.written) {
      const own = this.shot.files[file];
      if (at <= asked) continue;
      if (own) state.files[file] = own;
      else delete state.files[file];
    }
    this.shot = state;
    this.frame = Math.min(this.frame, Math.max(0, state.frames - 1));
    this.tell("files");
  }

  /**
   * Changes settings. `set` says what they are to be, given what they are: when another tab changed
   * some meanwhile, it is asked again, so that neither takes the other's change away.
   */
  async change(set: (now: Settings) => Record<string, unknown>, rig?: string): Promise<void> {
    for (let tries = 1; ; tries++) {
      const { shot, settings, settings_version } = this.opened;
      try {
        const asked = this.writes;
        return this.take(await api.changeSettings(shot, settings_version, set(settings), rig), asked);
      } catch (error) {
        if (!(error instanceof api.Refused) || error.status !== 409 || tries === MOST_TRIES) throw error;
        await this.refresh();
      }
    }
  }

  /** Runs a stage and waits for its end; `Result` is the document that its command prints. */
  async run<Result>(
    stage: string,
    more: { force?: boolean; movie?: boolean } = {},
  ): Promise<{ ran: boolean; kept: string[]; result: Result }> {
    const { job } = await api.run(this.opened.shot, stage, more);
    if (!this.ended.has(job)) {
      this.job = { job, stage, done: 0, total: null };
      this.tell("job");
    }
    const end = this.ended.get(job) ?? (await new Promise<End>((told) => this.waiting.set(job, told)));
    if ("fault" in end) throw end.fault;
    return { ran: end.done.ran, kept: end.done.kept, result: end.done.result as Result };
  }

  private hear<Name extends keyof Events>(name: Name, data: Events[Name]): void {
    const event = { name, data } as { [N in keyof Events]: { name: N; data: Events[N] } }[keyof Events];
    switch (event.name) {
      case "hello":
        return this.greeted(event.data.job);
      case "lost":
        return this.lost();
      case "progress":
        this.job = event.data;
        return this.tell("job");
      case "done":
        return this.jobEnded(event.data.job, { done: event.data });
      case "failed": {
        const { job, error, hint } = event.data;
        return this.jobEnded(job, { fault: new api.Refused(422, error, hint, null) });
      }
      case "cancelled":
        return this.jobEnded(event.data.job, { fault: new api.Stopped() });
      case "changed": {
        const files = Object.entries(event.data.files);
        const ours = files.length > 0 && files.every(([file, v]) => this.version(file) === v);
        if (!ours) void this.refresh();
      }
    }
  }

  /** The connection stands, for the first time or again: what was told meanwhile has been missed. */
  private greeted(job: api.JobStatus | null): void {
    this.connected = true;
    this.job = job;
    this.tell("line");
    this.tell("job");
    if (this.greetings++ > 0) void this.refresh();
    for (const [waited, tell] of this.waiting) {
      if (waited === job?.job) continue;
      this.waiting.delete(waited);
      tell({
        fault: new api.Refused(0, "The connection was lost while this ran", "the page shows how far it came", null),
      });
    }
  }

  private lost(): void {
    if (!this.connected) return;
    this.connected = false;
    this.tell("line");
  }

  private jobEnded(job: string, end: End): void {
    this.job = null;
    this.ended.set(job, end);
    // The files first: who waited for the end looks at them.
    void this.refresh()
      .catch(() => undefined)
      .finally(() => {
        this.tell("job");
        this.waiting.get(job)?.(end);
        this.waiting.delete(job);
      });
  }
}

export const store = new Store();
