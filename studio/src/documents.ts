// What the stages answer and store, as far as the page shows it; docs/formats.md describes all of it.

export type Verdict = "usable" | "doubtful" | "unusable";

/** What `segment` answers. */
export interface Segmented {
  frames: number;
  flagged: { flag: string; words: string; excludes: boolean; frames: number[] }[];
  correct_next: number | null;
  kept: string[];
  made: number;
}

export interface Component {
  variance_share: number;
  r: number;
  peak_hz: number;
}

/** `analysis/diagnosis.json`. */
export interface Diagnosis {
  verdict: Verdict;
  reasons: string[];
  advice: string[];
  cycles: number;
  step_hz: number;
  step_frames: number;
  stride_hz: number | null;
  stride_frames: number | null;
  band_hz: [number, number];
  components: Component[];
}

export interface Key {
  key: number;
  frame: number;
  time_s: number;
  partner_of: number | null;
}

export interface BudgetLine {
  keys: number;
  expected_error_share: number;
}

/** `keys/keys.json`. What the page does not name stays as it is when the keys are edited. */
export interface Keys {
  method: string;
  keys: Key[];
  mirrored?: boolean;
  expected_error_share: number | null;
  budget: BudgetLine[];
  next_frame: number | null;
  proven_optimal: boolean;
}

/** `animation.json`. */
export interface AnimationSummary {
  animation: string;
  fps: number;
  frames: number;
  first_frame: number;
  method: string;
  weight_range: [number, number];
  sum_range: [number, number];
  exchanged_sides?: number[];
  retime: number;
  loop: { duration_s: number } | null;
  feet: { gait: string | null; warnings: string[] } | null;
}
