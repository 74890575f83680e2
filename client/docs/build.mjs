/* Turns the documentation into pages and packs it, with its pictures, into one file for groomd to embed.
 *   node build.mjs OUTPUT
 * OUTPUT: lines "name<TAB>media type<TAB>bytes", an empty line, then the files one behind the other. */
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { marked } from '../web/node_modules/marked/lib/marked.esm.js';

const here = dirname(fileURLToPath(import.meta.url)), [output] = process.argv.slice(2);
const TYPES = { png: 'image/png', jpg: 'image/jpeg', css: 'text/css; charset=utf-8', html: 'text/html; charset=utf-8' };

/* A heading's name in an address: its words. */
const anchor = (text) => text.toLowerCase().replaceAll(/<[^>]*>|[^\w\s-]/g, '').trim().replaceAll(/\s+/g, '-');
marked.use({ renderer: {
    heading({ tokens, depth }) {
        const text = this.parser.parseInline(tokens);
        return `<h${depth} id="${anchor(text)}">${text}</h${depth}>\n`;
    },
    image({ href, text }) { return `<img src="/docs/${href.split('/').pop()}" alt="${text}" loading="lazy">`; },
    link({ href, tokens }) { return `<a href="${href.replace(/^([\w-]+)\.md/, '/docs/$1.html').replace('/docs/index.html', '/docs/')}">${this.parser.parseInline(tokens)}</a>`; },
} });

function page(name) {
    const text = readFileSync(join(here, name), 'utf8'), title = /^# (.*)$/m.exec(text)[1];
    return `<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>${title} – groomd</title>`
        + '<link rel="icon" href="data:,"><link rel="stylesheet" href="/docs/docs.css">'
        + `<header><a href="/">studio</a> <a href="/docs/">help</a> <a href="/openapi.json">interface</a></header><main>${marked.parse(text)}</main></html>\n`;
}

const files = readdirSync(here).sort().filter((name) => name.endsWith('.md')).map((name) => [name.replace('.md', '.html'), Buffer.from(page(name))]);
files.push(['docs.css', readFileSync(join(here, 'docs.css'))]);
for (const name of readdirSync(join(here, 'pictures')).sort()) files.push([name, readFileSync(join(here, 'pictures', name))]);
const table = files.map(([name, bytes]) => `${name}\t${TYPES[name.split('.').pop()]}\t${bytes.length}\n`).join('');
writeFileSync(output, Buffer.concat([Buffer.from(`${table}\n`), ...files.map(([, bytes]) => bytes)]));
