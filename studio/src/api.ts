// Requests to the program that serves this page. Every change names the version it is based on.

export type Rectangle = [number, number, number, number];
export type StageName = "segment" | "analyze" | "keys" | "weights" | "animate" | "report";

export interface PoseOfKey {
  key: number;
  clip: string;
  frame?: number;
  time?: number;
}

export interface Settings {
  source: { foreground: Rectangle | null; background: Rectangle | null; from: string | null };
  analysis: { gait: string };
  keys: { count: number; partners: boolean; include: number[]; partner_of: [number, number][] };
  animation: {
    method: string;
    mirror: string;
    amplitude: boolean;
    fps: number;
    retime: number;
    loop_strides: number;
  };
  feet: { plant: boolean; root: string };
  poses: { rig: string | null; pose: PoseOfKey[] };
}

export interface JobStatus {
  job: string;
  stage: string;
  done: number;
  total: number | null;
}

export interface ShotState {
  shot: string;
  name: string;
  width: number;
  height: number;
  frames: number;
  fps: number;
  footage: boolean;
  footage_version: string | null;
  footage_problem: string | null;
  settings: Settings;
  settings_version: string;
  stages: Record<string, { state: "missing" | "stale" | "fresh" }>;
  files: Record<string, string>;
  edited: string[];
  job: JobStatus | null;
}

export interface Entry {
  name: string;
  path: string;
  kind: "folder" | "shot" | "video" | "images" | "rig" | "file";
  count: number | null;
}

export interface Clip {
  name: string;
  duration_s: number;
  frames: number[];
}

/** What the program refused, in its words. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    message: string,
    readonly hint: string | null,
    readonly version: string | null,
  ) {
    super(message);
  }
}

/** A job was stopped by somebody, which is no fault. */
export class Stopped extends Error {
  constructor() {
    super("stopped; the shot is as it was before");
  }
}

async function refusal(response: Response): Promise<Refused> {
  try {
    const body = (await response.json()) as { error: string; hint?: string | null; version?: string | null };
    return new Refused(response.status, body.error, body.hint ?? null, body.version ?? null);
  } catch {
    return new Refused(response.status, `the studio answered ${response.status}`, null, null);
  }
}

async function request(path: string, init: RequestInit = {}): Promise<Response> {
  const headers = new Headers(init.headers);
  if (init.method && init.method !== "GET") headers.set("X-Muybridge", "1");
  let response: Response;
  try {
    response = await fetch(path, { ...init, headers });
  } catch {
    const hint = "start it again with `muybridge studio`; everything drawn so far is in the shot";
    throw new Refused(0, "the studio does not answer", hint, null);
  }
  if (!response.ok) throw await refusal(response);
  return response;
}

async function json<T>(method: string, path: string, body?: unknown): Promise<T> {
  const init: RequestInit = { method };
  if (body !== undefined) {
    init.body = JSON.stringify(body);
    init.headers = { "Content-Type": "application/json" };
  }
  return (await request(path, init)).json() as Promise<T>;
}

const of = (shot: string) => `shot=${encodeURIComponent(shot)}`;

export const session = () => json<{ version: string; root: string; shot: string | null }>("GET", "/api/session");

/** An address that opens the studio in another browser, once. */
export const invitation = () => json<{ url: string }>("POST", "/api/invitation");

export const browse = (path: string) =>
  json<{ path: string; parent: string | null; entries: Entry[] }>(
    "GET",
    `/api/browse?path=${encodeURIComponent(path)}`,
  );

export const makeShot = (wanted: object) => json<unknown>("POST", "/api/shots", wanted);

export const shotState = (shot: string) => json<ShotState>("GET", `/api/shot?${of(shot)}`);

export const changeSettings = (shot: string, version: string, set: Record<string, unknown>, rig?: string) =>
  json<ShotState>("PATCH", `/api/shot?${of(shot)}`, { version, set, ...(rig ? { rig } : {}) });

export const run = (shot: string, stage: string, more: { force?: boolean; movie?: boolean } = {}) =>
  json<{ job: string }>("POST", "/api/run", { shot, stage, ...more });

export const cancel = (job: string) => json<unknown>("POST", "/api/cancel", { job });

export const fileUrl = (shot: string, name: string, version = "", download = false) =>
  `/api/file?${of(shot)}&name=${encodeURIComponent(name)}&v=${version}${download ? "&download=1" : ""}`;

export async function text(shot: string, name: string): Promise<string> {
  return (await request(fileUrl(shot, name))).text();
}

export async function bytes(url: string): Promise<ArrayBuffer> {
  return (await request(url)).arrayBuffer();
}

export async function putFile(shot: string, name: string, body: Blob | string, version: string): Promise<string> {
  const init = { method: "PUT", body, headers: { "If-Match": `"${version}"` } };
  const answer = await request(fileUrl(shot, name), init);
  return ((await answer.json()) as { version: string }).version;
}

export async function deleteFile(shot: string, name: string, version: string): Promise<void> {
  const init = { method: "DELETE", headers: { "If-Match": `"${version}"` } };
  await request(fileUrl(shot, name), init);
}

export const frameUrl = (state: ShotState, frame: number, width: number) =>
  `/api/frame?${of(state.shot)}&frame=${frame}&width=${width}&v=${state.footage_version ?? ""}`;

export const rigUrl = (path: string) => `/api/rig?path=${encodeURIComponent(path)}`;

export const rigClips = (path: string) =>
  json<{ clips: Clip[]; joints: number; meshes: number }>("GET", `/api/rig/clips?path=${encodeURIComponent(path)}`);

/** What a job ended with. */
export interface Done {
  job: string;
  ran: boolean;
  /** Files edited by hand that were not overwritten. */
  kept: string[];
  /** The document the command prints. */
  result: unknown;
}

/** What the program tells of a shot, and what became of the connection. */
export interface Events {
  hello: { job: JobStatus | null };
  progress: JobStatus;
  done: Done;
  failed: { job: string; error: string; hint: string | null };
  cancelled: { job: string };
  changed: { files: Record<string, string> };
  lost: null;
}

/** A connection that was refused is tried again after this time. */
const LISTEN_AGAIN_MS = 2000;

const TOLD = ["hello", "progress", "done", "failed", "cancelled", "changed"] as const;

/** Listens to what happens to a shot; the function returned stops it. */
export function listen(
  shot: string,
  heard: <Name extends keyof Events>(name: Name, data: Events[Name]) => void,
): () => void {
  let source: EventSource;
  let timer: number | undefined;
  const begin = () => {
    source = new EventSource(`/api/events?${of(shot)}`);
    const hear = <Name extends (typeof TOLD)[number]>(name: Name) =>
      source.addEventListener(name, (event: MessageEvent<string>) => {
        heard(name, JSON.parse(event.data) as Events[Name]);
      });
    TOLD.forEach(hear);
    source.onerror = () => {
      heard("lost", null);
      // A browser gives up on a program that was started anew and does not know this page yet.
      if (source.readyState === EventSource.CLOSED) timer = window.setTimeout(begin, LISTEN_AGAIN_MS);
    };
  };
  begin();
  return () => {
    clearTimeout(timer);
    source.close();
  };
}
