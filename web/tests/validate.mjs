// Checks glTF files with the Khronos validator: node validate.mjs a.glb b.glb. Prints a line for
// each; any error or warning is a failure.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

let bad = 0;
for (const file of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 10 });
  console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos`);
  const worth = issues.messages.filter((message) => message.severity < 2);
  worth.forEach(({ code, message, pointer }) => console.log(`  ${code} ${pointer}: ${message}`));
  bad += issues.numErrors + issues.numWarnings;
}
process.exit(bad ? 1 : 0);
