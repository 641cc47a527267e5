// Silhouettes: finding them, and how they are shown over the footage.

import type { Segmented } from "./documents";
import { checkbox, percent, slider } from "./dom";
import { offer, say } from "./say";
import { store } from "./store";

/** How masks are shown over the footage. */
export function maskView(): HTMLElement[] {
  return [
    slider(
      "Mask",
      store.view.maskOpacity,
      { min: 0, max: 1, step: 0.05 },
      (v) => store.setView({ maskOpacity: v }),
      percent,
    ),
    checkbox("Onion skin: frame before in red, after in blue", store.view.onion, (v) => store.setView({ onion: v })),
  ];
}

/** Finds the silhouettes and says what came of it. */
export async function segment(force = false): Promise<void> {
  const { result, ran } = await store.run<Segmented>("segment", { force });
  if (!ran) return say("The silhouettes are up to date.");
  const flagged = new Set(result.flagged.filter((f) => f.excludes).flatMap((f) => f.frames)).size;
  const next = result.correct_next;
  const hint = next === null ? null : `Frame ${next} is the least sure one; a stroke there helps most.`;
  const told = `${result.made} of ${result.frames} silhouettes were made, ${flagged} frames are flagged.`;
  if (next === null) say(told);
  else offer(told, hint, { label: `Go to frame ${next}`, act: () => store.setFrame(next) });
}
