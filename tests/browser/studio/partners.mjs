// Partners on the built-in horse: asked for, accepted, changed, and there again when keys are chosen anew.

import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";

import * as stage from "./stage.mjs";
import { drag, look, painted, root, state, step, toFrame, toStart, work } from "./stage.mjs";

const SHOT = "horse";

const keysOf = () => JSON.parse(fs.readFileSync(path.join(root, SHOT, "keys/keys.json"), "utf8")).keys;
const partners = () => keysOf().filter((k) => k.partner_of !== null);

export async function partnersOfKeys() {
  const { page } = stage;
  await toStart();
  await page.click("#sample");
  await page.fill("#shot-name", SHOT);
  await page.fill("#range", "0-59");
  await page.click("#make");
  await painted(0);
  await fewerMistakes();
  await work("#segment", "segment");
  await step("analysis");
  await work("#analyze", "analyze");
  await step("keys");
  await page.click("label.check:has-text('Partners')");
  await page.waitForFunction(
    async (s) => (await (await fetch(`/api/shot?shot=${s}`)).json()).settings.keys.partners,
    SHOT,
  );
  await work("#choose", "keys");
  await page.waitForSelector(".key:has-text('Partner of key 1')");
  await accept();
  await change();
  await look("partners");
  await anew();
}

/** The rectangles of a built-in clip are known; drawing one again replaces it. */
async function fewerMistakes() {
  const size = await state(SHOT);
  const [x, y, w, h] = size.settings.source.foreground;
  await drag(
    [
      [x + 2, y + 2],
      [x + w - 2, y + h - 2],
    ],
    size,
  );
  for (let tries = 0; tries < 50; tries++) {
    const drawn = (await state(SHOT)).settings.source.foreground;
    if (drawn[0] !== x) return;
    await stage.page.waitForTimeout(100);
  }
  throw new Error("the rectangle was not replaced");
}

const card = (key) => stage.page.locator(`.key:has-text('Partner of key ${key}')`);

async function accept() {
  await card(1).locator("button:has-text('Accept')").click();
  await card(1).locator("button:has-text('Accepted')").waitFor();
  const first = partners().find((k) => k.partner_of === 1);
  assert.deepEqual((await state(SHOT)).settings.keys.partner_of, [[1, first.frame]]);
}

async function change() {
  const second = partners().find((k) => k.partner_of === 2);
  const frames = keysOf().map((k) => k.frame);
  const other = [1, -1, 2, -2].map((by) => second.frame + by).find((t) => t >= 0 && t < 60 && !frames.includes(t));
  await toFrame(other);
  await card(2).locator("button:has-text('Change to here')").click();
  await stage.page.locator(`.key[data-frame="${other}"]`).waitFor();
  assert.equal(partners().find((k) => k.partner_of === 2).frame, other);
  await card(2).locator("button:has-text('Accept')").click();
  await card(2).locator("button:has-text('Accepted')").waitFor();
}

/** What was accepted is there again; everything else is the program's own choice. */
async function anew() {
  const accepted = (await state(SHOT)).settings.keys.partner_of;
  assert.equal(accepted.length, 2);
  await work("#choose", "keys");
  await stage.page.click(".message button:has-text('Choose anew')");
  await stage.page.waitForSelector(".message:has-text('partners are chosen')");
  const now = partners();
  for (const [key, frame] of accepted) assert.equal(now.find((k) => k.partner_of === key).frame, frame);
  console.log("partners: accepted and changed ones are there when keys are chosen anew");
}
