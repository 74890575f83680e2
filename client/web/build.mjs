/* Bundles the studio into one folder, each file as it is and gzip-compressed, for groomd to embed.
 *   node build.mjs ENGINE OUTPUT */
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { build } from 'esbuild';

const here = dirname(fileURLToPath(import.meta.url)), [engine, output] = process.argv.slice(2);
mkdirSync(output, { recursive: true });
await build({
    entryPoints: { studio: join(here, 'src/main.mjs'), worker: join(here, 'src/worker.mjs') },
    outdir: output, bundle: true, minify: true, format: 'esm', target: 'es2022', legalComments: 'eof',
    loader: { '.glsl': 'text' }, logLevel: 'warning',
});
copyFileSync(join(here, 'index.html'), join(output, 'index.html'));
copyFileSync(engine, join(output, 'engine.wasm'));
for (const name of ['index.html', 'studio.js', 'studio.css', 'worker.js', 'engine.wasm'])
    writeFileSync(join(output, `${name}.gz`), gzipSync(readFileSync(join(output, name)), { level: 9 }));
