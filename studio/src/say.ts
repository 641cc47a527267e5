// Messages to the user, read aloud by screen readers.

import { Refused, Stopped } from "./api";
import { button, h } from "./dom";

/** How long a message stays, milliseconds. One that asks for something stays longer. */
const STAYS_MS = 6000;
const FAULT_STAYS_MS = 20000;

const list = h("div", { className: "messages", role: "status", "aria-live": "polite" });
document.body.append(list);

export interface Offer {
  label: string;
  act: () => void;
}

function show(message: string, hint: string | null, kind: string, stays: number, offer?: Offer): void {
  const close = () => entry.remove();
  const take = offer && button(offer.label, () => (close(), offer.act()));
  const entry: HTMLElement = h(
    "div",
    { className: `message ${kind}` },
    h("div", {}, h("p", {}, message), hint ? h("p", { className: "hint" }, hint) : null, take),
    button("×", close, { className: "quiet close", "aria-label": "Close this message" }),
  );
  // The same message twice is one message.
  for (const old of [...list.children]) if (old.textContent === entry.textContent) old.remove();
  list.append(entry);
  setTimeout(close, stays);
}

/** Takes away what was said of another step; what went wrong stays. */
export function quieten(): void {
  for (const entry of [...list.children]) if (!entry.classList.contains("fault")) entry.remove();
}

export function say(message: string, hint: string | null = null): void {
  show(message, hint, "", STAYS_MS);
}

/** Says something with an answer to choose. */
export function offer(message: string, hint: string | null, answer: Offer): void {
  show(message, hint, "", FAULT_STAYS_MS, answer);
}

/** A sentence as sentences are written: the program's begin small. */
const sentence = (text: string) => text.charAt(0).toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".");

/** Says what went wrong. */
export function complain(error: unknown): void {
  if (error instanceof Stopped) return say(sentence(error.message));
  const hint = error instanceof Refused ? error.hint : null;
  const text = error instanceof Error ? error.message : String(error);
  show(sentence(text), hint && sentence(hint), "fault", FAULT_STAYS_MS);
}

/** Runs something that may fail and says so. */
export function attempt(act: () => Promise<unknown>): void {
  act().catch(complain);
}
