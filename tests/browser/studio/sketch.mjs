// The sketch route on twelve frames: strokes on every frame are the silhouettes.

import assert from "node:assert/strict";

import * as stage from "./stage.mjs";
import { drag, look, make, masks, painted, saved, state, step, strokesOf, toStart, work } from "./stage.mjs";

const FRAMES = 12;

export async function sketch() {
  await toStart();
  await make("sketch", { from: "footage", frames: `0-${FRAMES - 1}`, fps: 24 });
  const size = await state("sketch");
  await step("paint");
  for (let frame = 0; frame < FRAMES; frame++) {
    if (frame > 0) await stage.page.keyboard.press("ArrowRight");
    await painted(frame);
    await draw(frame, size);
    await saved("sketch", strokesOf(frame));
  }
  await stage.page.click("label.check:has-text('Onion skin')");
  await stage.page.keyboard.press("ArrowLeft");
  await stage.page.waitForTimeout(300);
  await look("sketch");
  await stage.page.click("label.check:has-text('Onion skin')");
  await undoing();
  await copying();
  await polyline(size);
  await work("#segment", "segment");
  assert.equal(Object.keys(masks(await state("sketch"))).length, FRAMES);
  await look("sketch-silhouettes");
}

/** A body and two legs that sway. */
async function draw(frame, { width: w, height: h, ...rest }) {
  const size = { width: w, height: h, ...rest };
  const sway = Math.sin((frame * Math.PI) / 3) * w * 0.05;
  await drag(
    [
      [w * 0.35, h * 0.4],
      [w * 0.65, h * 0.4],
    ],
    size,
  );
  await drag(
    [
      [w * 0.4, h * 0.4],
      [w * 0.4 + sway, h * 0.7],
    ],
    size,
  );
  await drag(
    [
      [w * 0.6, h * 0.4],
      [w * 0.6 - sway, h * 0.7],
    ],
    size,
  );
}

const fileOf = async (frame) => (await state("sketch")).files[strokesOf(frame)] ?? "";

async function changes(frame, before) {
  for (let tries = 0; tries < 50; tries++) {
    const now = await fileOf(frame);
    if (now !== before) return now;
    await stage.page.waitForTimeout(100);
  }
  throw new Error(`the strokes of frame ${frame} did not change`);
}

/** Steps are undone one by one, also after the frame was left, and done again, up to the same file. */
async function undoing() {
  const { page } = stage;
  const frame = FRAMES - 2;
  const whole = await fileOf(frame);
  await page.keyboard.press("ArrowLeft");
  await painted(frame - 1);
  await page.keyboard.press("ArrowRight");
  await painted(frame);
  let now = whole;
  for (let left = 3; left > 0; left--) {
    await page.keyboard.press("Control+z");
    now = await changes(frame, now);
  }
  assert.equal(now, "", "with nothing drawn on it the frame has no strokes");
  for (let left = 3; left > 0; left--) {
    await page.keyboard.press("Control+Shift+z");
    now = await changes(frame, now);
  }
  assert.equal(now, whole, "what was undone and done again is the same file");
}

/** A cleared frame takes over what is on the one before. */
async function copying() {
  const { page } = stage;
  const frame = FRAMES - 2;
  const before = await fileOf(frame);
  await page.click("button:has-text('Clear')");
  await saved("sketch", strokesOf(frame), true);
  await page.keyboard.press("c");
  const copied = await changes(frame, "");
  assert.equal(copied, await fileOf(frame - 1), "a copy is the same file");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  assert.equal(await changes(frame, copied).then(async () => (await page.waitForTimeout(400), fileOf(frame))), before);
}

/** A polyline ends by a double click, as drawn. */
async function polyline(size) {
  const { page } = stage;
  const before = await fileOf(FRAMES - 2);
  await page.click("button[aria-pressed]:has-text('Polyline')");
  const corner = async (x, y) => page.mouse.click(...(await stage.placed(size.width * x, size.height * y, size)));
  await corner(0.2, 0.2);
  await page.waitForTimeout(500);
  await corner(0.4, 0.25);
  await page.waitForTimeout(500);
  await corner(0.6, 0.2);
  await corner(0.6, 0.2);
  const drawn = await changes(FRAMES - 2, before);
  await page.keyboard.press("Control+z");
  assert.equal(await changes(FRAMES - 2, drawn), before);
  await page.click("button[aria-pressed]:has-text('Brush')");
}
