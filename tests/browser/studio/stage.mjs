// What the parts of the studio's test share: the program, the browser, looking and drawing.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

import { chromium } from "playwright-core";

const here = path.dirname(fileURLToPath(import.meta.url));
export const project = path.resolve(here, "../../..");
export const binary = path.resolve(process.env.MUYBRIDGE_BIN ?? path.join(project, "target/release/muybridge"));
export const data = process.env.MUYBRIDGE_DATA ?? path.resolve(project, "../shared/data");
const axe = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** The folder the studio works on. */
export const root = fs.mkdtempSync(path.join(os.tmpdir(), "studio-"));
export const pictures = process.env.MUYBRIDGE_SHOTS ?? path.join(root, "screenshots");
fs.mkdirSync(pictures, { recursive: true });

export const DESKTOP = { width: 1280, height: 720 };
export const TABLETS = { landscape: { width: 1024, height: 768 }, portrait: { width: 768, height: 1024 } };

/** What went wrong that need not end the test. */
export const faults = [];
export let shots = 0;
/** The page at work. */
export let page;
export let url;
let server;
let browser;

/** Runs the program to its end. */
export const run = (args, cwd = root) =>
  execFileSync(binary, ["-q", ...args], { cwd, stdio: ["ignore", "ignore", "inherit"] });

/** Starts the studio; its address is `url`. */
export async function startServer(port = 0) {
  const args = ["--json", "studio", "--no-browser", "--port", String(port)];
  server = spawn(binary, args, { cwd: root, stdio: ["ignore", "pipe", "inherit"] });
  const own = server;
  url = await new Promise((resolve, reject) => {
    let text = "";
    own.stdout.on("data", (chunk) => {
      text += chunk;
      const found = /\{[\s\S]*?\}/.exec(text);
      if (found) resolve(JSON.parse(found[0]).url);
    });
    own.on("exit", (code) => reject(new Error(`the studio ended with ${code}`)));
  });
}

/** Ends the studio: as from the keyboard, or at once. */
export function stopServer(signal = "SIGINT") {
  return new Promise((resolve) => {
    if (!server || server.exitCode !== null) return resolve();
    server.removeAllListeners("exit");
    server.on("exit", resolve);
    server.kill(signal);
  });
}

const COMMON = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
/** WebGL by software, which the rig needs; flat pictures are painted faster without. */
export const WEB_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
export const FLAT = ["--disable-gpu"];

/** Notes what a page must not do. */
function watch(tab) {
  tab.setDefaultTimeout(60000);
  tab.on("console", (message) => {
    if (message.type() === "error" && !tab.mayFail) faults.push(`console: ${message.text()}`);
  });
  tab.on("pageerror", (error) => faults.push(`page: ${error.message}`));
  tab.on("request", (request) => {
    const target = new URL(request.url());
    const ours = target.origin === new URL(url).origin;
    if (!ours && !["blob:", "data:"].includes(target.protocol)) faults.push(`request to ${target.origin}`);
  });
}

/** Opens the studio in a browser of its own. */
export async function open(flags) {
  // The printed address opens the page once; for another browser the page gives another.
  const address = page ? await invitation() : url;
  await browser?.close();
  browser = await chromium.launch({
    executablePath: process.env.MUYBRIDGE_CHROMIUM ?? "/usr/bin/chromium",
    args: [...COMMON, ...flags],
  });
  const context = await browser.newContext({ viewport: DESKTOP });
  await prepare(context);
  page = await context.newPage();
  watch(page);
  await page.goto(address);
  await page.waitForSelector("#make");
}

/** While the page is worked on: its files from a folder, not from the program. */
async function prepare(context) {
  const folder = process.env.MUYBRIDGE_PAGE;
  if (!folder) return;
  await context.route("**/assets/*", (route) =>
    route.fulfill({ path: path.join(folder, new URL(route.request().url()).pathname) }),
  );
}

const invitation = () =>
  page.evaluate(
    async () =>
      (await (await fetch("/api/invitation", { method: "POST", headers: { "X-Muybridge": "1" } })).json()).url,
  );

/** Another tab beside this one, on the same address. */
export async function tab() {
  const beside = await page.context().newPage();
  watch(beside);
  await beside.goto(page.url());
  return beside;
}

/** Gives the work to another tab, which comes to the front. */
export async function turnTo(other) {
  page = other;
  await other.bringToFront();
}

export async function closeBrowser() {
  await browser?.close();
  browser = undefined;
  page = undefined;
}

/** Waits until nothing runs. */
export async function settled() {
  await page.waitForFunction(() => document.querySelector(".progress")?.childElementCount === 0, null, {
    timeout: 300000,
  });
}

/** Waits for the end of the work that a button starts, and passes when nothing was complained of. */
export async function work(button, stage) {
  const ended = page.waitForResponse((answer) => answer.url().endsWith("/api/run"));
  await page.click(button);
  assert.equal((await ended).status(), 202);
  await page.waitForTimeout(100);
  await settled();
  const complaint = await page.$(".message.fault");
  if (complaint) throw new Error(`${stage}: ${await complaint.innerText()}`);
}

/** A picture of the page, and no serious finding, in light and dark. */
export async function look(name) {
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    await page.waitForTimeout(100);
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
    for (const violation of found.violations) {
      if (["serious", "critical"].includes(violation.impact)) {
        faults.push(`${name}, ${colorScheme}: ${violation.id} at ${violation.nodes.map((n) => n.target).join(" ; ")}`);
      }
    }
    const spilt = await page.evaluate(
      () => document.documentElement.scrollWidth > innerWidth || document.documentElement.scrollHeight > innerHeight,
    );
    if (spilt) faults.push(`${name}, ${colorScheme}: the page is larger than the window`);
    await page.screenshot({
      path: path.join(pictures, `${String(++shots).padStart(2, "0")}-${name}-${colorScheme}.png`),
    });
  }
  await page.emulateMedia({ colorScheme: "light" });
}

/** The page on a tablet, signed in as this browser is; `page` until `leave` is called. */
export async function onTablet(viewport = TABLETS.landscape) {
  const desktop = page;
  const storageState = await desktop.context().storageState();
  const context = await browser.newContext({ viewport, hasTouch: true, isMobile: true, storageState });
  await prepare(context);
  page = await context.newPage();
  watch(page);
  await page.goto(desktop.url());
  await page.waitForSelector("#make, #step-footage");
  const leave = async () => {
    await context.close();
    page = desktop;
  };
  return { leave };
}

/** Looks at steps on a tablet, lying and standing. */
export async function lookOnTablet(...steps) {
  for (const [way, viewport] of Object.entries(TABLETS)) {
    const { leave } = await onTablet(viewport);
    for (const name of steps) {
      if (name !== "start") await page.tap(`#step-${name}`);
      await page.waitForTimeout(700);
      await look(`${name}-${way}`);
    }
    await leave();
  }
}

export const state = (shot) => page.evaluate(async (s) => (await fetch(`/api/shot?shot=${s}`)).json(), shot);
export const step = (name) => page.click(`#step-${name}`);
export const masks = (s) => Object.fromEntries(Object.entries(s.files).filter(([name]) => name.startsWith("masks/")));
export const strokesOf = (frame) => `strokes/${String(frame).padStart(6, "0")}.png`;

/** Where a pixel of the footage is on the screen, the picture being shown whole. */
export async function placed(x, y, { width, height }) {
  const box = await page.locator("canvas.viewer").boundingBox();
  const scale = Math.min(box.width / width, box.height / height);
  return [box.x + (box.width - width * scale) / 2 + x * scale, box.y + (box.height - height * scale) / 2 + y * scale];
}

export async function drag(points, size) {
  const first = await placed(...points[0], size);
  await page.mouse.move(...first);
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...(await placed(...point, size)), { steps: 6 });
  await page.mouse.up();
}

/** Waits until a frame is painted. */
export const painted = (frame) =>
  page.waitForFunction((t) => document.querySelector("canvas.viewer")?.dataset.frame === String(t), frame);

export async function toFrame(frame) {
  await page.evaluate((t) => {
    const slide = document.querySelector("#frame");
    slide.value = String(t);
    slide.dispatchEvent(new Event("input"));
  }, frame);
  await painted(frame);
}

/** The first screen, wherever the page is. */
export async function toStart() {
  if (await page.$(".rail .shot")) await page.click(".rail .shot");
  await page.waitForSelector("#make");
}

/** Makes a shot on the first screen. */
export async function make(name, fields) {
  if (fields.kind) await page.selectOption("form select", fields.kind);
  await page.fill("#from", fields.from);
  await page.fill("#shot-name", name);
  if (fields.fps) await page.fill("#fps", String(fields.fps));
  if (fields.frames) await page.fill("#range", fields.frames);
  await page.click("#make");
  await page.waitForSelector("#step-footage");
  await painted(0);
}

/** Waits until a file is in the shot, or, with `gone`, no more. */
export async function saved(shot, name, gone = false) {
  for (let tries = 0; tries < 50; tries++) {
    if (Boolean((await state(shot)).files[name]) !== gone) return;
    await page.waitForTimeout(100);
  }
  throw new Error(`${name} was not ${gone ? "deleted" : "saved"}`);
}
