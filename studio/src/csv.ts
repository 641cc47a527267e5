// Tables of the shot folder: numbers separated by commas, a header line.

export type Table = Map<string, number[]>;

export function parse(text: string): Table {
  const lines = text.trim().split("\n");
  const header = (lines[0] ?? "").split(",");
  const table: Table = new Map(header.map((name) => [name, []]));
  for (const line of lines.slice(1)) {
    const cells = line.split(",");
    header.forEach((name, at) => {
      const cell = cells[at] ?? "";
      table.get(name)!.push(cell === "" ? NaN : Number(cell));
    });
  }
  return table;
}

export const column = (table: Table, name: string): number[] => table.get(name) ?? [];

/** Frames whose flags keep them out of the analysis, of `analysis/silhouettes.csv`. */
export function flaggedFrames(text: string): number[] {
  const lines = text.trim().split("\n");
  const at = (lines[0] ?? "").split(",").indexOf("flags");
  return lines.slice(1).flatMap((line) => {
    const cells = line.split(",");
    const flags = (cells[at] ?? "").split(" ").filter(Boolean);
    const counts = flags.some((flag) => flag !== "corrected" && flag !== "several_pieces");
    return counts ? [Number(cells[0])] : [];
  });
}
