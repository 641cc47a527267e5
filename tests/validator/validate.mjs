// Runs the Khronos glTF validator on the files given as arguments and prints, as JSON, a list of
// { file, problems: ["CODE pointer message", …] } in the order of the arguments; problems are the
// validator's errors and warnings.
import { readFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { validateBytes } from 'gltf-validator';

const SEVERITY_WARNING = 1;
const reports = [];
for (const file of process.argv.slice(2)) {
  const bytes = new Uint8Array(await readFile(file));
  const report = await validateBytes(bytes, {
    maxIssues: 0,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  const problems = report.issues.messages
    .filter((m) => m.severity <= SEVERITY_WARNING)
    .map((m) => `${m.code} ${m.pointer ?? ''} ${m.message}`);
  reports.push({ file, problems });
}
console.log(JSON.stringify(reports));
