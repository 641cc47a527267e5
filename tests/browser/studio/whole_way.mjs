// From an empty folder to an exported rig, through the page alone; then the same by the command line,
// which has to leave the same bytes.

import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";

import * as stage from "./stage.mjs";
import {
  drag,
  look,
  lookOnTablet,
  make,
  masks,
  root,
  run,
  saved,
  state,
  step,
  strokesOf,
  toFrame,
  work,
} from "./stage.mjs";

const SHOT = "shot";

/** Footage, its two rectangles, and a rig with a clip. */
export function material() {
  const rig = path.join(root, "rig.glb");
  const davis = path.join(stage.data, "video/davis/frames/flamingo");
  if (fs.existsSync(davis)) {
    fs.cpSync(davis, path.join(root, "footage"), { recursive: true });
    fs.copyFileSync(path.join(stage.data, "rigs/khronos_fox.glb"), rig);
    const all = JSON.parse(fs.readFileSync(path.join(stage.data, "video/davis/rectangles.json"), "utf8"));
    return { ...all.flamingo, clip: "Walk", strokes: [30, 60], fps: 24 };
  }
  console.log(`skipped: real footage is not at ${stage.data}; the sample sequences are taken instead`);
  const given = sample();
  fs.cpSync(path.join(stage.project, given.frames), path.join(root, "footage"), { recursive: true });
  fs.copyFileSync(path.join(stage.project, "poses/horse.glb"), rig);
  return given;
}

/** The sample footage with the rectangles its own description gives. */
function sample() {
  const frames = "sequences/gallop";
  const about = fs.readFileSync(path.join(stage.project, frames, "README.md"), "utf8");
  const rectangle = (name) => new RegExp(`--${name} (\\d+),(\\d+),(\\d+),(\\d+)`).exec(about).slice(1).map(Number);
  return {
    frames,
    foreground: rectangle("foreground"),
    background: rectangle("background"),
    clip: "Gallop",
    strokes: [10, 20],
    fps: 25,
  };
}

export async function wholeWay(given) {
  await look("start");
  await lookOnTablet("start");
  await chooseFootage();
  await make(SHOT, { from: "footage", fps: given.fps });
  const size = await state(SHOT);
  await rectangles(given, size);
  const last = await corrections(given, size);
  await analysis();
  await keys();
  await poses(given);
  await result();
  await lookOnTablet("footage", "paint", "analysis", "keys", "poses", "result");
  await compare(last);
}

/** The footage is found by walking through the folder. */
async function chooseFootage() {
  const { page } = stage;
  await page.click("#choose-source");
  await page.waitForSelector("dialog .entries button");
  await look("choose");
  await page.click("dialog .entries button:has-text('footage')");
  assert.equal(await page.inputValue("#from"), "footage");
}

async function rectangles(given, size) {
  const { page } = stage;
  const corners = ([x, y, w, h]) => [
    [x, y],
    [x + w, y + h],
  ];
  await drag(corners(given.foreground), size);
  await page.waitForSelector("button.pick.background[aria-pressed='true']");
  await drag(corners(given.background), size);
  await page.waitForFunction(() => !document.querySelector("#segment").disabled);
  await look("footage");
  await work("#segment", "segment");
  await look("silhouettes");
}

/** Strokes on two frames one after the other: the second changes no frame before the first. */
async function corrections(given, size) {
  const { page } = stage;
  const plain = await state(SHOT);
  const [first, second] = given.strokes;
  const stroke = async (frame) => {
    await step("paint");
    await toFrame(frame);
    await drag(
      [
        [size.width * 0.45, size.height * 0.4],
        [size.width * 0.55, size.height * 0.45],
      ],
      size,
    );
    await saved(SHOT, strokesOf(frame));
  };
  await stroke(first);
  await look("paint");
  await work("#segment", "segment");
  const once = await state(SHOT);
  await stroke(second);
  await work("#segment", "segment");
  const twice = await state(SHOT);
  const changed = (a, b) =>
    Object.keys(masks(a))
      .filter((name) => a.files[name] !== b.files[name])
      .map((name) => Number(name.slice(6, 12)));
  const reached = changed(once, twice);
  console.log(`masks changed by the first stroke: ${changed(plain, once).length}, by the second: ${reached.length}`);
  assert.ok(reached.length > 0 && reached.every((t) => t > first), `a stroke on ${second} changed ${reached}`);
  await page.click("button[aria-pressed]:has-text('Mask')");
  await look("paint-mask");
  await page.click("button[aria-pressed]:has-text('Strokes')");
  return twice;
}

async function analysis() {
  const { page } = stage;
  await step("analysis");
  await look("analysis-before");
  await work("#analyze", "analyze");
  await page.waitForSelector("#verdict");
  await page.waitForSelector(".plots svg");
  console.log(`verdict: ${await page.innerText("#verdict")}`);
  // Every plot that shows frames leads to them.
  for (const plot of [0, 1]) {
    await toFrame(0);
    const box = await page.locator(".plots svg").nth(plot).boundingBox();
    await page.mouse.click(box.x + 0.7 * box.width, box.y + 0.4 * box.height);
    await page.waitForFunction(() => document.querySelector("#frame").value !== "0");
  }
  await look("analysis");
}

const keysOf = async () => JSON.parse(fs.readFileSync(path.join(root, SHOT, "keys/keys.json"), "utf8")).keys;

/** Lock, move, add and drop; and keys that were edited are not lost by choosing. */
async function keys() {
  const { page } = stage;
  await step("keys");
  await work("#choose", "keys");
  await page.waitForSelector(".sheet .key");
  const chosen = await keysOf();
  const card = (at) => page.locator(".sheet .key").nth(at);
  const until = (count) => page.waitForFunction((n) => document.querySelectorAll(".sheet .key").length === n, count);

  await card(0).locator("button:has-text('Lock')").click();
  await page.waitForSelector(".key button:has-text('Unlock')");
  const free = [1, 2, 3, 4, 5, 6].map((by) => chosen[0].frame + by).find((t) => chosen.every((k) => k.frame !== t));
  await toFrame(free);
  await card(0).locator("button:has-text('Move here')").click();
  await page.waitForFunction((t) => document.querySelector(".sheet .key.held")?.dataset.frame === String(t), free);
  assert.deepEqual((await state(SHOT)).settings.keys.include, [free], "the lock goes with the key");
  await toFrame(chosen[0].frame);
  await page.click("#add-key");
  await until(chosen.length + 1);
  const added = (await keysOf()).findIndex((k) => k.frame === chosen[0].frame);
  await card(added).locator("button:has-text('Drop')").click();
  await until(chosen.length);
  assert.deepEqual(
    (await keysOf()).map((k) => k.frame),
    [free, ...chosen.slice(1).map((k) => k.frame)].sort((a, b) => a - b),
  );

  await work("#choose", "keys");
  await page.waitForSelector(".message:has-text('Your own keys are kept')");
  await look("keys");
}

/** A pose to each key, from the clip's time. */
async function poses(given) {
  const { page } = stage;
  await step("poses");
  await look("poses-before");
  await page.click("#rig");
  await page.click("dialog button:has-text('rig.glb')");
  await page.waitForSelector("[data-assign]");
  await page.waitForFunction(() => document.querySelectorAll(".inspector option").length > 0);
  await page.selectOption(".inspector select", given.clip);
  const count = await page.locator("[data-assign]").count();
  for (let at = 0; at < count; at++) {
    await page.evaluate((part) => {
      const slide = document.querySelector("#pose-time");
      slide.value = String(Number(slide.max) * part);
      slide.dispatchEvent(new Event("input"));
    }, at / count);
    await page.click(`[data-assign="${at + 1}"]`);
    await page.waitForFunction((n) => document.querySelectorAll(".key:not(.missing)").length >= n, at + 1);
    if (at === 0) await look("poses-some");
  }
  await page.waitForFunction(() => document.querySelector("#missing")?.textContent === "Every key has a pose.");
  await look("poses");
}

async function result() {
  const { page } = stage;
  await step("result");
  for (const wanted of [false, true]) {
    const answered = page.waitForResponse((answer) => answer.request().method() !== "GET");
    await page.click("label.check:has-text('grow and shrink')");
    await answered;
    await page.waitForTimeout(200);
    assert.equal((await state(SHOT)).settings.animation.amplitude, wanted);
  }
  await work("#animate", "animate");
  await page.waitForSelector("a[download='animation.glb']");
  await page.waitForTimeout(500);
  const before = await page.evaluate(() => document.querySelector("canvas.rig").dataset.frame);
  await page.click("#play");
  await page.waitForFunction((b) => document.querySelector("canvas.rig").dataset.frame !== b, before);
  await page.click("#play");
  await work("#report", "report");
  await page.click("label.check:has-text('silhouette over')");
  await look("result");
}

/** The same settings, strokes and edited keys, by the command line alone. */
async function compare(twice) {
  const { page } = stage;
  const exported = await page.evaluate(async () => {
    const answer = await fetch(document.querySelector("a[download='animation.glb']").href);
    return [...new Uint8Array(await answer.arrayBuffer())];
  });
  const other = path.join(root, "other");
  fs.mkdirSync(path.join(other, SHOT, "keys"), { recursive: true });
  fs.cpSync(path.join(root, "footage"), path.join(other, "footage"), { recursive: true });
  fs.copyFileSync(path.join(root, "rig.glb"), path.join(other, "rig.glb"));
  const taken = (name) => fs.cpSync(path.join(root, SHOT, name), path.join(other, SHOT, name), { recursive: true });
  ["shot.toml", "strokes"].forEach(taken);
  run(["keys", SHOT], other);
  // What a person has edited.
  taken("keys/keys.json");
  run(["animate", SHOT], other);
  run(["report", SHOT], other);
  const same = (name) => {
    const [a, b] = [root, other].map((folder) => fs.readFileSync(path.join(folder, SHOT, name)));
    assert.ok(a.equals(b), `${name} differs from the command line's`);
  };
  const all = [
    ...Object.keys(masks(twice)),
    "analysis/projections.csv",
    "analysis/diagnosis.json",
    "keys/weights.csv",
    "animation.glb",
    "animation.bvh",
    "animation.json",
    "report.html",
  ];
  all.forEach(same);
  assert.ok(Buffer.from(exported).equals(fs.readFileSync(path.join(other, SHOT, "animation.glb"))));
  console.log(
    `${all.length} files (masks, analysis, weights, animation, report) equal the command line's, byte for byte`,
  );
}
