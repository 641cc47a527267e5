// Runs the Khronos glTF validator on the files given as arguments and prints, as JSON, a list of
// { file, errors: ["CODE pointer message", …], warnings: n } in the order of the arguments.
import { readFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { validateBytes } from 'gltf-validator';

const SEVERITY_ERROR = 0;
const reports = [];
for (const file of process.argv.slice(2)) {
  const bytes = new Uint8Array(await readFile(file));
  const report = await validateBytes(bytes, {
    maxIssues: 0,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  const errors = report.issues.messages
    .filter((m) => m.severity === SEVERITY_ERROR)
    .map((m) => `${m.code} ${m.pointer ?? ''} ${m.message}`);
  reports.push({ file, errors, warnings: report.issues.numWarnings });
}
console.log(JSON.stringify(reports));
