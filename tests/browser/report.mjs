// Opens reports in headless Chromium, in light and in dark, and fails on: an error on the console, a
// request that leaves the file, a serious finding of axe, a player that does not play, a rig that is not
// drawn, a page over 8 MB. Prints sizes.
//
//   node report.mjs DEMO/report.html [CLIP/report.html …] [--screenshots FOLDER]
import { createRequire } from "node:module";
import { mkdirSync, readFileSync, statSync } from "node:fs";
import { basename, dirname, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const LARGEST = 8_000_000;
const CHROMIUM = process.env.CHROMIUM || "/usr/bin/chromium";
const ARGUMENTS = [
  "--no-sandbox",
  "--disable-quic",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
];
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

const files = process.argv.slice(2);
const at = files.indexOf("--screenshots");
const pictures = at < 0 ? null : files.splice(at, 2)[1];
if (pictures) mkdirSync(pictures, { recursive: true });
if (files.length === 0) {
  console.error("usage: node report.mjs REPORT.html … [--screenshots FOLDER]");
  process.exit(2);
}

// How many colours a canvas holds: a blank one has one.
const colours = (canvas) => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const paint = copy.getContext("2d");
  paint.drawImage(canvas, 0, 0);
  const data = new Uint32Array(paint.getImageData(0, 0, copy.width, copy.height).data.buffer);
  return new Set(data).size;
};
const sum = (canvas) => canvas.toDataURL().length + ":" + canvas.toDataURL().slice(-4000);

async function checkPlayer(page, fail) {
  const player = page.locator("#player");
  if ((await player.count()) === 0) return "no player";
  const footage = player.locator("[data-part=footage]");
  if ((await footage.evaluate(colours)) < 10) fail("the footage's canvas is blank");
  const moment = player.locator("[data-part=moment]");
  await player.locator("[data-part=forward]").focus();
  await page.keyboard.press("ArrowRight");
  if (!(await moment.textContent()).startsWith("frame 1 ")) fail("the arrow key does not step");
  await page.keyboard.press("Home");
  const rig = player.locator("[data-part=rig]");
  if ((await rig.count()) === 0) return "no rig";
  if (await rig.isHidden()) {
    fail(`the rig is hidden: ${await player.locator("[data-part=no-rig]").textContent()}`);
    return "no rig";
  }
  if ((await rig.evaluate(colours)) < 30) fail("the rig's canvas is blank");
  const before = await rig.evaluate(sum);
  await player.locator("[data-part=scrub]").focus();
  for (let i = 0; i < 5; i += 1) await page.keyboard.press("ArrowRight");
  const moved = await rig.evaluate(sum);
  if (moved === before) fail("the rig does not move with the frame");
  await rig.focus();
  await page.keyboard.press("ArrowRight");
  if ((await rig.evaluate(sum)) === moved) fail("the rig does not turn");
  await player.locator("[data-view=side]").click();
  await player.locator("[data-part=play]").click();
  await page.waitForTimeout(600);
  await player.locator("[data-part=play]").click();
  if ((await moment.textContent()).startsWith("frame 5 ")) fail("it does not play");
  return "rig drawn";
}

// The whole page in pieces: a picture of all of it would be higher than a software renderer draws.
async function photograph(page, name) {
  const step = 1800;
  await page.setViewportSize({ width: 1280, height: step });
  const height = await page.evaluate(() => document.documentElement.scrollHeight);
  for (let top = 0; top < height; top += step) {
    await page.evaluate((y) => scrollTo(0, y), top);
    await page.screenshot({ path: `${name}-${top / step}.png` });
  }
}

async function check(browser, file, scheme) {
  const faults = [];
  const fail = (what) => faults.push(`${scheme}: ${what}`);
  const page = await browser.newPage({ colorScheme: scheme, viewport: { width: 1280, height: 900 } });
  page.on("console", (message) => {
    if (message.type() === "error") fail(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => fail(`script: ${error.message}`));
  page.on("request", (request) => {
    if (!/^(data|blob|file):/.test(request.url())) fail(`request: ${request.url()}`);
  });
  await page.goto(pathToFileURL(resolve(file)).href);
  await page.waitForTimeout(500);
  const drawn = await checkPlayer(page, fail);
  const counts = await page.evaluate(() => ({
    images: document.images.length,
    silent: [...document.images].filter((i) => !i.alt).length,
    broken: [...document.images].filter((i) => i.complete && !i.naturalWidth).length,
    plots: document.querySelectorAll("figure > svg").length,
    wide: document.documentElement.scrollWidth > innerWidth,
  }));
  if (counts.silent > 0) fail(`${counts.silent} pictures without a text alternative`);
  if (counts.broken > 0) fail(`${counts.broken} pictures are not shown`);
  if (counts.wide) fail("the page is wider than the window");
  // The page's own policy would refuse a script element; evaluation by the driver is not bound by it.
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run());
  for (const { id, impact, nodes } of violations) {
    if (impact === "serious" || impact === "critical") {
      fail(
        `axe: ${id} (${impact}) ${nodes
          .slice(0, 3)
          .map((n) => n.html.slice(0, 120))
          .join(" | ")}`,
      );
    }
  }
  if (pictures) await photograph(page, join(pictures, `${basename(dirname(resolve(file)))}-${scheme}`));
  await page.close();
  return { faults, drawn, counts };
}

const browser = await chromium.launch({ executablePath: CHROMIUM, args: ARGUMENTS });
let failed = false;
for (const file of files) {
  const bytes = statSync(file).size;
  const faults = bytes > LARGEST ? [`${bytes} bytes, over ${LARGEST}`] : [];
  let seen;
  for (const scheme of ["light", "dark"]) {
    seen = await check(browser, file, scheme);
    faults.push(...seen.faults);
  }
  const { drawn, counts } = seen;
  console.log(`${file}: ${(bytes / 1e6).toFixed(2)} MB, ${counts.images} pictures, ${counts.plots} plots, ${drawn}`);
  faults.forEach((fault) => console.log(`  ${fault}`));
  failed ||= faults.length > 0;
}
await browser.close();
process.exit(failed ? 1 : 0);
