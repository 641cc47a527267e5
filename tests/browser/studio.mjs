// The studio in a browser, from an empty folder to an exported rig, through the page alone; then the
// same by the command line, which has to leave the same bytes.
//
//   node studio.mjs [way] [sketch] [speed]     only these parts; all of them without
//
//   MUYBRIDGE_BIN    the program with the studio in it (default: ../../target/release/muybridge)
//   MUYBRIDGE_DATA   real footage and rigs (default: ../shared/data beside the project); without it
//                    the built-in animal is filmed
//   MUYBRIDGE_SHOTS  a folder for screenshots (default: a temporary one)

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

import { chromium } from "playwright-core";

const here = path.dirname(fileURLToPath(import.meta.url));
const project = path.resolve(here, "../..");
const binary = path.resolve(process.env.MUYBRIDGE_BIN ?? path.join(project, "target/release/muybridge"));
const data = process.env.MUYBRIDGE_DATA ?? path.resolve(project, "../shared/data");
const axe = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const root = fs.mkdtempSync(path.join(os.tmpdir(), "studio-"));
const pictures = process.env.MUYBRIDGE_SHOTS ?? path.join(root, "screenshots");
fs.mkdirSync(pictures, { recursive: true });

/** Footage, its two rectangles, and a rig with a clip. */
function material() {
  const rig = path.join(root, "rig.glb");
  const davis = path.join(data, "video/davis/frames/flamingo");
  if (fs.existsSync(davis)) {
    fs.cpSync(davis, path.join(root, "footage"), { recursive: true });
    fs.copyFileSync(path.join(data, "rigs/khronos_fox.glb"), rig);
    const all = JSON.parse(fs.readFileSync(path.join(data, "video/davis/rectangles.json"), "utf8"));
    return { ...all.flamingo, clip: "Walk", strokes: [30, 60], fps: 24 };
  }
  console.log("no real footage here: the built-in animal is filmed instead");
  const film = (extra) => execFileSync(binary, ["-q", "render", "--out", path.join(root, "footage"), ...extra]);
  film(["--color", "--clip", "walk", "--frames", "60", "--frames-per-cycle", "24", "--size", "480x320"]);
  execFileSync(binary, ["-q", "samples", "--out", path.join(root, "samples")]);
  const poses = path.join(root, "samples/poses");
  const file = fs.readdirSync(poses).find((name) => name.endsWith(".glb"));
  fs.copyFileSync(path.join(poses, file), rig);
  return { foreground: [200, 120, 70, 30], background: [10, 10, 460, 40], clip: null, strokes: [20, 40], fps: 24 };
}

let server;

/** Starts the studio; its address. */
function started() {
  server = spawn(binary, ["--json", "studio", "--no-browser"], { cwd: root, stdio: ["ignore", "pipe", "inherit"] });
  return new Promise((resolve, reject) => {
    let text = "";
    server.stdout.on("data", (chunk) => {
      text += chunk;
      const found = /\{[\s\S]*?\}/.exec(text);
      if (found) resolve(JSON.parse(found[0]).url);
    });
    server.on("exit", (code) => reject(new Error(`the studio ended with ${code}`)));
  });
}

const parts = process.argv.slice(2);
const asked = (part) => parts.length === 0 || parts.includes(part);

/** Back to the first screen, wherever the page is. */
async function start() {
  if (await page.$(".rail .shot")) await page.click(".rail .shot");
}

const faults = [];
let page;
let shots = 0;

async function settled() {
  await page.waitForFunction(() => document.querySelector(".progress")?.childElementCount === 0, null, { timeout: 300000 });
}

/** Waits for the end of the work that a button starts. */
async function work(button, stage) {
  await page.click(button);
  await page.waitForTimeout(150);
  await settled();
  const complaint = await page.$(".message.fault");
  if (complaint) throw new Error(`${stage}: ${await complaint.innerText()}`);
}

/** A picture of the page, and no serious finding, in light and dark. */
async function look(name) {
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    await page.waitForTimeout(80);
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
    for (const violation of found.violations) {
      if (["serious", "critical"].includes(violation.impact)) {
        faults.push(`${name}, ${colorScheme}: ${violation.id} at ${violation.nodes.map((n) => n.target).join(" ; ")}`);
      }
    }
    await page.screenshot({ path: path.join(pictures, `${String(++shots).padStart(2, "0")}-${name}-${colorScheme}.png`) });
  }
  await page.emulateMedia({ colorScheme: "light" });
}

const state = (shot) => page.evaluate(async (s) => (await fetch(`/api/shot?shot=${s}`)).json(), shot);

/** Where a pixel of the footage is on the screen. */
async function placed(x, y, { width, height }) {
  const box = await page.locator("canvas.viewer").boundingBox();
  const scale = Math.min(box.width / width, box.height / height);
  return [box.x + (box.width - width * scale) / 2 + x * scale, box.y + (box.height - height * scale) / 2 + y * scale];
}

async function drag(points, size) {
  const first = await placed(...points[0], size);
  await page.mouse.move(...first);
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...(await placed(...point, size)), { steps: 6 });
  await page.mouse.up();
}

async function toFrame(frame) {
  await page.evaluate((t) => {
    const slide = document.querySelector("#frame");
    slide.value = String(t);
    slide.dispatchEvent(new Event("input"));
  }, frame);
  await page.waitForFunction((t) => document.querySelector("canvas.viewer")?.dataset.frame === String(t), frame);
}

const step = (name) => page.click(`#step-${name}`);

async function make(name, fields) {
  await page.fill("#from", fields.from);
  await page.fill("#shot-name", name);
  if (fields.fps) await page.fill("#fps", String(fields.fps));
  if (fields.frames) await page.fill("#range", fields.frames);
  await page.click("#make");
  await page.waitForSelector("#step-footage");
  await page.waitForFunction(() => document.querySelector("canvas.viewer")?.dataset.frame === "0");
}

const masks = (s) => Object.fromEntries(Object.entries(s.files).filter(([name]) => name.startsWith("masks/")));

async function saved(shot, name) {
  for (let tries = 0; tries < 50; tries++) {
    if ((await state(shot)).files[name]) return;
    await page.waitForTimeout(100);
  }
  throw new Error(`${name} was not saved`);
}

async function wholeWay(given) {
  await look("start");
  await make("shot", { from: "footage", fps: given.fps });
  const size = await state("shot");
  const corners = ([x, y, w, h]) => [[x, y], [x + w, y + h]];
  await drag(corners(given.foreground), size);
  await page.waitForTimeout(300);
  await drag(corners(given.background), size);
  await page.waitForFunction(() => !document.querySelector("#segment").disabled);
  await look("footage");
  await work("#segment", "segment");
  await look("silhouettes");

  const plain = await state("shot");
  const [first, second] = given.strokes;
  const stroke = async (frame) => {
    await step("paint");
    await toFrame(frame);
    await drag([[size.width * 0.45, size.height * 0.4], [size.width * 0.55, size.height * 0.45]], size);
    await saved("shot", `strokes/${String(frame).padStart(6, "0")}.png`);
  };
  await stroke(first);
  await look("stroke");
  await work("#segment", "segment");
  const once = await state("shot");
  await stroke(second);
  await work("#segment", "segment");
  const twice = await state("shot");
  const changed = (a, b) => Object.keys(masks(a)).filter((name) => a.files[name] !== b.files[name]).map((name) => Number(name.slice(6, 12)));
  const reached = changed(once, twice);
  console.log(`masks changed by the first stroke: ${changed(plain, once).length}, by the second: ${reached.length}`);
  assert.ok(reached.length > 0 && reached.every((t) => t > first), `a stroke on ${second} changed ${reached}`);

  await step("analysis");
  await work("#analyze", "analyze");
  await page.waitForSelector("#verdict");
  await page.waitForSelector(".plots svg");
  console.log(`verdict: ${await page.innerText("#verdict")}`);
  await look("analysis");

  await step("keys");
  await work("#choose", "keys");
  await page.waitForSelector(".sheet .key");
  await toFrame(5);
  await page.click(".key button:has-text('Lock')");
  await page.waitForSelector(".key button:has-text('Unlock')");
  await look("keys");

  await step("poses");
  await page.click("#rig");
  await page.click("dialog button:has-text('rig.glb')");
  await page.waitForSelector("[data-assign]");
  await page.waitForFunction(() => document.querySelectorAll("select option").length > 0);
  if (given.clip) await page.selectOption(".inspector select", given.clip);
  const keys = await page.locator("[data-assign]").count();
  for (let at = 0; at < keys; at++) {
    await page.evaluate(([part]) => {
      const slide = document.querySelector("#pose-time");
      slide.value = String(Number(slide.max) * part);
      slide.dispatchEvent(new Event("input"));
    }, [at / keys]);
    await page.click(`[data-assign="${at + 1}"]`);
    await page.waitForFunction((n) => document.querySelectorAll(".key:not(.missing)").length >= n, at + 1);
  }
  await page.waitForFunction(() => document.querySelector("#missing")?.textContent === "Every key has a pose.");
  await look("poses");

  await step("result");
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
  const exported = await page.evaluate(async () => {
    const answer = await fetch(document.querySelector("a[download='animation.glb']").href);
    return [...new Uint8Array(await answer.arrayBuffer())];
  });

  // The same settings and strokes, by the command line alone.
  const other = path.join(root, "other");
  fs.mkdirSync(path.join(other, "shot"), { recursive: true });
  fs.cpSync(path.join(root, "footage"), path.join(other, "footage"), { recursive: true });
  fs.copyFileSync(path.join(root, "rig.glb"), path.join(other, "rig.glb"));
  fs.copyFileSync(path.join(root, "shot/shot.toml"), path.join(other, "shot/shot.toml"));
  fs.cpSync(path.join(root, "shot/strokes"), path.join(other, "shot/strokes"), { recursive: true });
  fs.mkdirSync(path.join(other, "shot/keys"), { recursive: true });
  execFileSync(binary, ["-q", "keys", "shot"], { cwd: other, stdio: ["ignore", "ignore", "inherit"] });
  // The lock came after the keys were chosen; the artist's poses belong to the keys they saw.
  fs.copyFileSync(path.join(root, "shot/keys/keys.json"), path.join(other, "shot/keys/keys.json"));
  execFileSync(binary, ["-q", "animate", "shot"], { cwd: other, stdio: ["ignore", "ignore", "inherit"] });
  const same = (name) => {
    const [a, b] = [root, other].map((folder) => fs.readFileSync(path.join(folder, "shot", name)));
    assert.ok(a.equals(b), `${name} differs from the command line's`);
  };
  for (const name of Object.keys(masks(twice))) same(name);
  ["analysis/projections.csv", "analysis/diagnosis.json", "keys/weights.csv", "animation.glb", "animation.bvh"].forEach(same);
  assert.ok(Buffer.from(exported).equals(fs.readFileSync(path.join(other, "shot/animation.glb"))));
  console.log("masks, analysis, weights and animation equal the command line's, byte for byte");
}

async function sketch() {
  await start();
  await make("sketch", { from: "footage", frames: "0-11", fps: 24 });
  const size = await state("sketch");
  await step("paint");
  const [w, h] = [size.width, size.height];
  for (let frame = 0; frame < 12; frame++) {
    if (frame > 0) await page.keyboard.press("ArrowRight");
    await page.waitForFunction((t) => document.querySelector("canvas.viewer")?.dataset.frame === String(t), frame);
    const sway = Math.sin((frame * Math.PI) / 3) * w * 0.05;
    await drag([[w * 0.35, h * 0.4], [w * 0.65, h * 0.4]], size);
    await drag([[w * 0.4, h * 0.4], [w * 0.4 + sway, h * 0.7]], size);
    await drag([[w * 0.6, h * 0.4], [w * 0.6 - sway, h * 0.7]], size);
    await saved("sketch", `strokes/${String(frame).padStart(6, "0")}.png`);
  }
  await look("sketch");
  await work("#segment", "segment");
  const done = await state("sketch");
  assert.equal(Object.keys(masks(done)).length, 12);
  // Undone and done again, nothing is left of it or all.
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+Shift+z");
}

async function latencies() {
  const clip = path.join(root, "large.mp4");
  try {
    execFileSync("ffmpeg", ["-v", "error", "-f", "lavfi", "-i", "testsrc2=size=1920x1080:rate=25", "-frames:v", "100", "-pix_fmt", "yuv420p", clip]);
  } catch {
    return console.log("no ffmpeg here: scrubbing was not measured");
  }
  await start();
  await make("large", { from: "large.mp4" });
  await page.waitForFunction(() => document.querySelector("#frame").max === "99", null, { timeout: 120000 });
  await page.waitForTimeout(3000);
  const times = await page.evaluate(async () => {
    const canvas = document.querySelector("canvas.viewer");
    // The first task after the next frame: what was drawn is on the screen.
    const painted = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
    const found = [];
    for (let t = 1; t <= 80; t++) {
      const begun = performance.now();
      document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
      while (canvas.dataset.frame !== String(t) && performance.now() - begun < 5000) await new Promise((resolve) => setTimeout(resolve, 1));
      await painted();
      found.push(performance.now() - begun);
      // A key that is held down repeats some thirty times a second.
      await new Promise((resolve) => setTimeout(resolve, 33));
    }
    return found.sort((a, b) => a - b);
  });
  const at = (share) => times[Math.floor(share * (times.length - 1))].toFixed(1);
  console.log(`scrubbing 1920 × 1080: median ${at(0.5)} ms, 95 % ${at(0.95)} ms, longest ${at(1)} ms from key to painted frame`);
  assert.ok(Number(at(0.5)) < 50, "scrubbing is slower than 50 ms");
  await step("paint");
  await page.evaluate(() => {
    window.blocked = [];
    new PerformanceObserver((list) => list.getEntries().forEach((e) => window.blocked.push(e.duration))).observe({ entryTypes: ["longtask"] });
  });
  const size = await state("large");
  await drag(Array.from({ length: 30 }, (_, k) => [400 + 30 * k, 500 + 200 * Math.sin(k / 3)]), size);
  await page.waitForTimeout(1500);
  const longest = await page.evaluate(() => Math.max(0, ...window.blocked));
  console.log(`painting 1920 × 1080: the page was never blocked for longer than ${longest.toFixed(0)} ms (0: under 50 ms)`);
  assert.ok(longest < 200, "painting blocks");
}

const given = material();
const url = await started();
const common = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
// WebGL by software, which the rig needs; flat pictures are painted faster without.
const webGl = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
let browser;

/** Another browser with a page that watches for faults. */
async function opened(flags) {
  await browser?.close();
  browser = await chromium.launch({
    executablePath: process.env.MUYBRIDGE_CHROMIUM ?? "/usr/bin/chromium",
    args: [...common, ...flags],
  });
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  page = await context.newPage();
  page.setDefaultTimeout(60000);
  page.on("console", (message) => {
    if (message.type() === "error") faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`page: ${error.message}`));
  page.on("request", (request) => {
    const target = new URL(request.url());
    const ours = target.origin === new URL(url).origin;
    if (!ours && !["blob:", "data:"].includes(target.protocol)) faults.push(`request to ${target.origin}`);
  });
  await page.goto(url);
  await page.waitForSelector("#make");
}

try {
  await opened(webGl);
  if (asked("way")) await wholeWay(given);
  await page.keyboard.press("?");
  await page.waitForSelector("dialog[open]");
  await look("shortcuts");
  await page.click("dialog button:has-text('Close')");
  if (asked("way")) {
    await page.setViewportSize({ width: 1024, height: 768 });
    await step("keys");
    await look("tablet");
    await page.setViewportSize({ width: 1280, height: 720 });
  }
  if (asked("sketch")) await sketch();
  if (asked("speed")) {
    await opened(["--disable-gpu"]);
    await latencies();
  }
} catch (error) {
  faults.push(error.stack ?? String(error));
  await page?.screenshot({ path: path.join(pictures, "fault.png") }).catch(() => undefined);
} finally {
  await browser?.close();
  server.removeAllListeners("exit");
  server.kill("SIGINT");
}
for (const fault of faults) console.error(`FAULT ${fault}`);
console.log(`${shots} screenshots${process.env.MUYBRIDGE_SHOTS ? ` in ${pictures}` : ""}, ${faults.length} faults`);
if (!process.env.MUYBRIDGE_KEEP) fs.rmSync(root, { recursive: true, force: true });
process.exit(faults.length > 0 ? 1 : 0);
