// The studio in a browser, from an empty folder to an exported rig, through the page alone; then the
// same by the command line, which has to leave the same bytes.
//
//   node studio.mjs [way] [sketch] [partners] [together] [speed]     only these parts; all of them without
//
//   MUYBRIDGE_BIN    the program with the studio in it (default: ../../target/release/muybridge)
//   MUYBRIDGE_DATA   real footage and rigs (default: ../shared/data beside the project); without it
//                    the sample sequences are taken
//   MUYBRIDGE_SHOTS  a folder for screenshots (default: a temporary one)
//   MUYBRIDGE_PAGE   a folder with the page's files, while it is worked on (default: those in the program)
//   MUYBRIDGE_KEEP   keep the folder that was worked in

import fs from "node:fs";
import path from "node:path";

import { partnersOfKeys } from "./studio/partners.mjs";
import { sketch } from "./studio/sketch.mjs";
import { speed } from "./studio/speed.mjs";
import * as stage from "./studio/stage.mjs";
import { together } from "./studio/together.mjs";
import { material, wholeWay } from "./studio/whole_way.mjs";

const parts = process.argv.slice(2);
const asked = (part) => parts.length === 0 || parts.includes(part);

async function shortcuts() {
  await stage.page.keyboard.press("?");
  await stage.page.waitForSelector("dialog[open]");
  await stage.look("shortcuts");
  await stage.page.click("dialog button:has-text('Close')");
}

const { faults, pictures, root } = stage;
try {
  const given = material();
  await stage.startServer();
  await stage.open(stage.WEB_GL);
  await shortcuts();
  if (asked("way")) await wholeWay(given);
  if (asked("sketch")) await sketch();
  if (asked("partners")) await partnersOfKeys();
  if (asked("together")) await together();
  if (asked("speed")) {
    await stage.open(stage.FLAT);
    await speed();
  }
} catch (error) {
  faults.push(error.stack ?? String(error));
  await stage.page?.screenshot({ path: path.join(pictures, "fault.png") }).catch(() => undefined);
} finally {
  await stage.closeBrowser();
  await stage.stopServer();
}
for (const fault of faults) console.error(`FAULT ${fault}`);
console.log(
  `${stage.shots} screenshots${process.env.MUYBRIDGE_SHOTS ? ` in ${pictures}` : ""}, ${faults.length} faults`,
);
if (process.env.MUYBRIDGE_KEEP) console.log(`kept: ${root}`);
else fs.rmSync(root, { recursive: true, force: true });
process.exit(faults.length > 0 ? 1 : 0);
