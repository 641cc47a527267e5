// Messages to the user, read aloud by screen readers.

import { Refused } from "./api";
import { button, h } from "./dom";

const list = h("div", { className: "messages", role: "status", "aria-live": "polite" });
document.body.append(list);

export function say(message: string, hint: string | null = null, fault = false): void {
  const entry = h(
    "div",
    { className: fault ? "message fault" : "message" },
    h("div", {}, h("p", {}, message), hint ? h("p", { className: "hint" }, hint) : null),
  );
  entry.append(button("Close", () => entry.remove(), { className: "quiet" }));
  list.append(entry);
  setTimeout(() => entry.remove(), fault ? 20000 : 6000);
}

/** Says what went wrong. */
export function complain(error: unknown): void {
  if (error instanceof Refused) say(error.message, error.hint, true);
  else say(error instanceof Error ? error.message : String(error), null, true);
}

/** Runs something that may fail and says so. */
export function attempt(act: () => Promise<unknown>): void {
  act().catch(complain);
}
