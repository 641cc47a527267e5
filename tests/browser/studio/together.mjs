// Two tabs on one shot, a program that is killed, a pen and fingers: nothing is lost.

import assert from "node:assert/strict";

import * as stage from "./stage.mjs";
import { drag, make, painted, saved, state, step, strokesOf, toFrame, toStart } from "./stage.mjs";

const SHOT = "together";

export async function together() {
  await toStart();
  await make(SHOT, { from: "footage", frames: "0-5", fps: 24 });
  const size = await state(SHOT);
  await twoTabs(size);
  await touches(size);
  await killed(size);
}

const line = (size, y) => [
  [size.width * 0.3, size.height * y],
  [size.width * 0.6, size.height * y],
];
const fileOf = async (frame) => (await state(SHOT)).files[strokesOf(frame)] ?? "";

/** Both tabs draw on one frame and change settings; what the other did is never overwritten. */
async function twoTabs(size) {
  const one = stage.page;
  await step("paint");
  await toFrame(2);
  const two = await stage.tab();
  await stage.turnTo(two);
  await two.waitForSelector("#step-paint");
  await step("paint");
  await toFrame(2);
  await stage.turnTo(one);
  await drag(line(size, 0.3), size);
  await saved(SHOT, strokesOf(2));
  const theirs = await fileOf(2);
  // The other tab has seen it, so that its stroke is one more.
  await two.waitForTimeout(1500);
  await stage.turnTo(two);
  await drag(line(size, 0.6), size);
  for (let tries = 0; (await fileOf(2)) === theirs; tries++) {
    assert.ok(tries < 50, "the other tab's stroke was not saved");
    await two.waitForTimeout(100);
  }
  assert.equal(await two.locator(".message").count(), 0, "a tab that has seen the other's stroke has no conflict");

  // Both change settings at the same time; the browser notes the refusal that leads to a second try.
  one.mayFail = two.mayFail = true;
  await step("keys");
  await stage.turnTo(one);
  await step("analysis");
  await Promise.all([
    one.selectOption(".inspector select", "walk"),
    // At one stroke: a number half typed when the other tab's change redraws the field can be lost (docs/studio.md).
    two.locator(".inspector input[type=number]").evaluate((field) => {
      field.value = "6";
      field.dispatchEvent(new Event("change"));
    }),
  ]);
  const chosen = async () => {
    const { settings } = await state(SHOT);
    return [settings.analysis.gait, settings.keys.count];
  };
  // One of the two is refused and tried again, which takes as long as the machine lets it.
  const both = ["walk", 6];
  for (let tries = 0; tries < 50 && String(await chosen()) !== String(both); tries++) {
    await one.waitForTimeout(100);
  }
  assert.deepEqual(
    await chosen(),
    both,
    "neither tab takes the other's setting away",
  );
  one.mayFail = false;
  await two.close();
  console.log("two tabs: strokes and settings of both are in the shot");
}

/** One finger draws, two move and zoom and draw nothing; pressure makes the line thicker. */
async function touches(size) {
  const { leave } = await stage.onTablet();
  const { page } = stage;
  await step("paint");
  await toFrame(3);
  const client = await page.context().newCDPSession(page);
  const touch = async (type, ...points) => {
    const touchPoints = await Promise.all(
      points.map(async ([x, y], id) => {
        const [px, py] = await stage.placed(size.width * x, size.height * y, size);
        return { x: px, y: py, id };
      }),
    );
    await client.send("Input.dispatchTouchEvent", { type, touchPoints });
  };
  await touch("touchStart", [0.3, 0.5]);
  await touch("touchMove", [0.4, 0.5]);
  await touch("touchMove", [0.5, 0.5]);
  await touch("touchEnd");
  await saved(SHOT, strokesOf(3));
  const drawn = await fileOf(3);
  await touch("touchStart", [0.4, 0.5]);
  await touch("touchStart", [0.4, 0.5], [0.6, 0.5]);
  for (const by of [0.02, 0.04, 0.08]) await touch("touchMove", [0.4 - by, 0.5], [0.6 + by, 0.5]);
  await touch("touchEnd");
  await page.waitForTimeout(700);
  assert.equal(await fileOf(3), drawn, "two fingers draw nothing");
  const zoom = await page.innerText(".zoomer .zoom");
  await page.click("button[aria-label='Show the whole picture']");
  await page.waitForFunction((z) => document.querySelector(".zoomer .zoom").textContent !== z, zoom);

  const pen = (kind, x, pressure) =>
    page.evaluate(
      ([type, px, py, force]) => {
        const at = {
          clientX: px,
          clientY: py,
          pressure: force,
          pointerType: "pen",
          pointerId: 9,
          bubbles: true,
          button: type === "pointermove" ? -1 : 0,
          buttons: 1,
        };
        const canvas = document.querySelector("canvas.viewer");
        canvas.setPointerCapture = () => undefined;
        canvas.dispatchEvent(new PointerEvent(type, at));
      },
      [kind, ...x, pressure],
    );
  const height = async (frame, pressure) => {
    await toFrame(frame);
    const [from, to] = await Promise.all(line(size, 0.5).map(([x, y]) => stage.placed(x, y, size)));
    await pen("pointerdown", from, pressure);
    await pen("pointermove", to, pressure);
    await pen("pointerup", to, pressure);
    await saved(SHOT, strokesOf(frame));
    return page.evaluate(
      async ([shot, name]) => {
        const picture = await createImageBitmap(await (await fetch(`/api/file?shot=${shot}&name=${name}`)).blob());
        const canvas = new OffscreenCanvas(picture.width, picture.height);
        const context = canvas.getContext("2d");
        context.drawImage(picture, 0, 0);
        const column = context.getImageData(Math.round(picture.width * 0.45), 0, 1, picture.height).data;
        return column.filter((v, at) => at % 4 === 3 && v > 0).length;
      },
      [SHOT, strokesOf(frame)],
    );
  };
  const [light, hard] = [await height(4, 0.2), await height(5, 1)];
  assert.ok(light > 0 && hard > 2 * light, `a stroke of ${light} pixels at light, ${hard} at full pressure`);
  await leave();
  console.log(
    `touch draws, two fingers zoom; the pen's line is ${light} px wide at light and ${hard} px at full pressure`,
  );
}

/** The program is killed while somebody draws: the page says so and saves when it is back. */
async function killed(size) {
  const { page } = stage;
  await step("paint");
  await toFrame(1);
  const port = Number(new URL(stage.url).port);
  page.mayFail = true;
  await stage.stopServer("SIGKILL");
  await page.waitForFunction(() => document.querySelector(".outage").textContent !== "");
  await drag(line(size, 0.4), size);
  await page.waitForTimeout(600);
  await stage.startServer(port);
  // The new program knows this browser by the new address only.
  const beside = await page.context().newPage();
  await beside.goto(stage.url);
  await beside.close();
  await page.waitForFunction(() => document.querySelector(".outage").textContent === "", null, { timeout: 30000 });
  await saved(SHOT, strokesOf(1));
  for (const close of await page.$$(".message .close")) await close.click();
  page.mayFail = false;
  await toFrame(2);
  await painted(2);
  console.log("the program was killed and started again: what was drawn meanwhile is in the shot");
}
