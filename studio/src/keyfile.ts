// `keys/keys.json`: reading and editing it as a person would.

import * as api from "./api";
import type { Key, Keys } from "./documents";
import { store } from "./store";

const FILE = "keys/keys.json";

export async function readKeys(): Promise<Keys | null> {
  if (!store.version(FILE)) return null;
  return JSON.parse(await api.text(store.opened.shot, FILE)) as Keys;
}

export const keysVersion = () => store.version(FILE);

/** The number of a key that is new. */
export const NEW = -1;

/**
 * Keys by frame, numbered on; partners after them, in the order of their keys. With the number that
 * each has now, by the one it had.
 */
function numbered(keys: Key[], fps: number): { keys: Key[]; now: Map<number, number> } {
  const plain = keys.filter((k) => k.partner_of === null).sort((a, b) => a.frame - b.frame);
  const owner = new Map(plain.map((k, at) => [k.key, at + 1]));
  const ownerOf = (k: Key) => (k.partner_of === null ? undefined : owner.get(k.partner_of));
  const partners = keys.filter((k) => ownerOf(k) !== undefined).sort((a, b) => ownerOf(a)! - ownerOf(b)!);
  const all = [...plain, ...partners];
  return {
    keys: all.map((k, at) => ({ key: at + 1, frame: k.frame, time_s: k.frame / fps, partner_of: ownerOf(k) ?? null })),
    now: new Map(all.map((k, at) => [k.key, at + 1])),
  };
}

/**
 * Changes the keys. When another tab changed them meanwhile, `change` is asked again, on what is there
 * now. The poses of keys that have another number afterwards go with them.
 */
export async function editKeys(change: (keys: Key[]) => Key[]): Promise<void> {
  for (let tries = 0; ; tries++) {
    const document = await readKeys();
    if (!document) return;
    const { shot, fps } = store.opened;
    const { keys, now } = numbered(change(document.keys), fps);
    const text = JSON.stringify({ ...document, keys, proven_optimal: false });
    try {
      store.wrote(FILE, await api.putFile(shot, FILE, text, store.version(FILE)));
    } catch (error) {
      if (!(error instanceof api.Refused && error.status === 409) || tries === 4) throw error;
      await store.refresh();
      continue;
    }
    return followKeys(now);
  }
}

/** What was said of a key, its pose and its partner, follows the key to its number. */
async function followKeys(now: Map<number, number>): Promise<void> {
  const { poses, keys } = store.opened.settings;
  const said = [...poses.pose.map(({ key }) => key), ...keys.partner_of.map(([key]) => key)];
  if (said.every((key) => now.get(key) === key)) return;
  await store.change(({ poses, keys }) => ({
    "poses.pose": poses.pose
      .flatMap((p) => (now.has(p.key) ? [{ ...p, key: now.get(p.key)! }] : []))
      .sort((a, b) => a.key - b.key),
    "keys.partner_of": keys.partner_of
      .flatMap(([key, frame]) => (now.has(key) ? [[now.get(key)!, frame]] : []))
      .sort(([a], [b]) => a! - b!),
  }));
}
