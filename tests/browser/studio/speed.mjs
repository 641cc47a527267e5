// How long from a key to the painted frame, whether it is the right frame, and whether painting blocks.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";

import * as stage from "./stage.mjs";
import { drag, make, root, state, step, toStart } from "./stage.mjs";

const FRAMES = 100;
const SHOT = "large";

/** Side of the squares that count the frames in binary, pixels. */
const SQUARE = 96;
const BITS = 7;

/** A bound that only a defect passes; the figures are printed. */
const SANE_MS = 500;

/** A clip of 1920 × 1080 in H.264, each frame of which shows its number. */
function film() {
  const squares = Array.from({ length: BITS }, (_, bit) => {
    const lit = `gte(mod(floor(n/${2 ** bit})\\,2)\\,1)`;
    return `drawbox=x=${SQUARE * bit}:y=0:w=${SQUARE}:h=${SQUARE}:color=white:t=fill:enable='${lit}'`;
  });
  const dark = `drawbox=x=0:y=0:w=${SQUARE * BITS}:h=${SQUARE}:color=black:t=fill`;
  const source = ["-f", "lavfi", "-i", "testsrc2=size=1920x1080:rate=25"];
  const filter = ["-vf", [dark, ...squares].join(","), "-frames:v", String(FRAMES)];
  execFileSync("ffmpeg", ["-v", "error", ...source, ...filter, "-pix_fmt", "yuv420p", path.join(root, "large.mp4")]);
}

export async function speed() {
  try {
    film();
  } catch {
    return console.log("skipped: no ffmpeg here, so scrubbing was not measured");
  }
  await toStart();
  await make(SHOT, { from: "large.mp4" });
  const { page } = stage;
  await page.waitForFunction((n) => document.querySelector("#frame").max === String(n), FRAMES - 1, {
    timeout: 120000,
  });
  await page.waitForTimeout(3000);
  await scrubbing("footage alone");
  await masksOverIt();
  await scrubbing("with masks over it");
  await jumps();
  await painting();
}

/** Masks of the footage's size with many edges, as another program would put them there. */
async function masksOverIt() {
  const folder = path.join(root, SHOT, "masks");
  fs.mkdirSync(folder, { recursive: true });
  const filter = ["-vf", "format=gray,lutyuv=y=if(gt(val\\,128)\\,255\\,0)", "-frames:v", String(FRAMES)];
  const source = ["-f", "lavfi", "-i", "testsrc2=size=1920x1080:rate=25"];
  execFileSync("ffmpeg", ["-v", "error", ...source, ...filter, "-start_number", "0", path.join(folder, "%06d.png")]);
  const known = async () => Object.keys(stage.masks(await state(SHOT))).length;
  while ((await known()) < FRAMES) await stage.page.waitForTimeout(200);
  await stage.page.waitForTimeout(2500);
}

/** Real keys, one after the other, about as fast as one that is held down repeats. */
async function scrubbing(what) {
  const { page } = stage;
  await stage.toFrame(0);
  await page.waitForTimeout(1500);
  await page.evaluate(() => {
    window.times = [];
    if (window.timing) return;
    window.timing = true;
    const canvas = document.querySelector("canvas.viewer");
    let pressed = 0;
    document.addEventListener("keydown", (event) => (pressed = event.timeStamp), { capture: true });
    new MutationObserver(() => {
      const begun = pressed;
      if (!begun || canvas.dataset.frame === "") return;
      pressed = 0;
      // The first task after the next frame: what was drawn is on the screen.
      requestAnimationFrame(() => setTimeout(() => window.times.push(performance.now() - begun)));
    }).observe(canvas, { attributes: true, attributeFilter: ["data-frame"] });
  });
  for (let t = 1; t < FRAMES; t++) {
    await page.keyboard.press("ArrowRight");
    await stage.painted(t);
    assert.equal(await shownNumber(), t, "another frame is shown than the one that is named");
    await page.waitForTimeout(20);
  }
  await page.waitForTimeout(300);
  const times = (await page.evaluate(() => window.times)).sort((a, b) => a - b);
  const at = (share) => times[Math.floor(share * (times.length - 1))];
  const told = [0.5, 0.95, 1].map((share) => at(share).toFixed(1));
  console.log(
    `scrubbing 1920 × 1080, ${what}: median ${told[0]} ms, 95 % ${told[1]} ms, longest ${told[2]} ms from key to painted frame (${times.length} keys)`,
  );
  assert.ok(times.length > FRAMES / 2 && at(0.5) < SANE_MS, "scrubbing is not measured, or much slower than 50 ms");
}

/** The number that the painted frame shows. */
const shownNumber = () =>
  stage.page.evaluate(
    ([square, bits]) => {
      const canvas = document.querySelector("canvas.viewer");
      const scale = Math.min(canvas.width / 1920, canvas.height / 1080);
      const [left, top] = [(canvas.width - 1920 * scale) / 2, (canvas.height - 1080 * scale) / 2];
      const small = new OffscreenCanvas(bits, 1);
      const context = small.getContext("2d");
      let number = 0;
      for (let bit = 0; bit < bits; bit++) {
        context.drawImage(canvas, left + (bit + 0.5) * square * scale, top + 0.3 * square * scale, 1, 1, bit, 0, 1, 1);
        if (context.getImageData(bit, 0, 1, 1).data[0] > 127) number += 2 ** bit;
      }
      return number;
    },
    [SQUARE, BITS],
  );

/** Any frame, in any order, is the one that is named. */
async function jumps() {
  for (const frame of [99, 3, 57, 56, 98, 0, 31, 64]) {
    await stage.toFrame(frame);
    assert.equal(await shownNumber(), frame);
  }
}

async function painting() {
  const { page } = stage;
  await step("paint");
  await page.evaluate(() => {
    window.blocked = [];
    new PerformanceObserver((list) => list.getEntries().forEach((e) => window.blocked.push(e.duration))).observe({
      entryTypes: ["longtask"],
    });
  });
  const size = await state(SHOT);
  for (let stroke = 0; stroke < 3; stroke++) {
    await drag(
      Array.from({ length: 30 }, (_, k) => [400 + 30 * k, 400 + 150 * stroke + 100 * Math.sin(k / 3)]),
      size,
    );
    await page.waitForTimeout(700);
  }
  const longest = await page.evaluate(() => Math.max(0, ...window.blocked));
  console.log(
    `painting 1920 × 1080: the page was never blocked for longer than ${longest.toFixed(0)} ms (0: under 50 ms)`,
  );
  assert.ok(longest < SANE_MS, "painting blocks");
}
