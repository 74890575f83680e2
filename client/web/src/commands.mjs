/* What the page asks of the daemon, as lines for a shell: groomctl's and curl's. Nothing of a browser is
 * needed here; tests run the lines. */

const DEFAULT_SERVER = 'http://127.0.0.1:8080';

/** A word of a shell's line. */
export const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${String(text).replaceAll("'", `'\\''`)}'`);

const words = (...parts) => parts.flat().filter((part) => part !== undefined && part !== '').map((part) => quoted(String(part))).join(' ');
const flag = (name, value) => (value === undefined || value === null || value === '' ? [] : [`--${name}`, value]);
const text_of = (value) => (typeof value === 'string' ? value : JSON.stringify(value));

/* --- groomctl -------------------------------------------------------------------------------------- */

const piped = (body, ...parts) => `printf %s ${quoted(JSON.stringify(body))} | groomctl ${words(...parts)}`;

function upload(kind) {
    return ({ query, file }) => [kind, query.get('name') || file || 'FILE', flag('unit', query.get('unit')), flag('up', query.get('up')), flag('format', query.get('format'))];
}

const FIT_FLAGS = { guides: 'guides', operator_guides: 'operator-guides', vertices: 'vertices', quality: 'quality', seed: 'seed' };

/* Nested options by their dotted paths, arrays whole. */
function flat(options, prefix = '') {
    return Object.entries(options).flatMap(([name, value]) => (value && typeof value === 'object' && !Array.isArray(value)
        ? flat(value, `${prefix}${name}.`) : [['--option', `${prefix}${name}=${JSON.stringify(value)}`]])).flat();
}

function fit({ body }) {
    const { operators, ...options } = body.options ?? {};
    const known = Object.entries(FIT_FLAGS).flatMap(([name, option]) => flag(option, options[name]));
    const others = Object.fromEntries(Object.entries(options).filter(([name]) => !(name in FIT_FLAGS)));
    return ['fit', body.strands, flag('head', body.head), known, flag('operators', Array.isArray(operators) ? operators.join(',') : operators), flag('priority', body.priority), flat(others)];
}

/* A target's hairline stands in a file. */
function retarget({ body }) {
    const { guides, iterations, mode, seed, ...others } = body.options ?? {}, { head, hairline } = body.target;
    const line = words('retarget', body.strands ?? body.groom, head, flag('source', body.source?.head), body.dense ? '--dense' : '', flag('revision', body.revision),
        Object.entries({ guides, iterations, mode, seed }).map(([name, value]) => flag(name, value)).flat(), flat(others), hairline ? ['--hairline', 'hairline.json'] : []);
    return { line: `${hairline ? `printf %s ${quoted(JSON.stringify(hairline))} > hairline.json && ` : ''}groomctl ${line}` };
}

const job = (call) => (call.body.kind === 'retarget' ? retarget(call) : fit(call));

/* "set" adds and removes; what else a patch does goes through "patch". */
function patch({ id, body }) {
    const simple = Array.isArray(body) && body.every(({ op, value }) => (op === 'add' && text_of(value) !== '') || op === 'remove');
    if (!simple) return { line: piped(body, 'patch', id, '-') };
    return ['set', id, body.map(({ op, path, value }) => `${path}=${op === 'remove' ? '' : text_of(value)}`)];
}

const LAYER_FLAGS = {
    ruffle: ['rho', 'match_elements', 'blend', 'seed', 'groups', 'layer', 'elements', 'head'],
    interpolate: ['t', 'groom', 'revision', 'strands', 'layer', 'elements', 'head'],
    'curl-scale': ['radius', 'step', 'keep', 'largest_radius', 'group', 'groups', 'layer', 'elements', 'head'],
    sculpt: ['stiffness', 'layer', 'elements', 'head'],
};

/* Flags where all of it has flags, else the body as it is. */
function layer(kind) {
    return ({ id, body }) => {
        const { commit, points, ...given } = body, known = LAYER_FLAGS[kind];
        const fits = Object.entries(given).every(([name, value]) => value == null || (known.includes(name) && typeof value !== 'object'));
        if (!fits) return { line: piped(given, kind, id, '--body', '-') };
        return [kind, id, known.flatMap((name) => flag(name.replaceAll('_', '-'), given[name]))];
    };
}

const target = (file) => ['-o', file ?? 'FILE'];
const asked = (query, ...names) => names.flatMap((name) => flag(name.replaceAll('_', '-'), query.get(name)));
const degrees = (query, ...names) => names.flatMap((name) => flag(name, query.has(name) ? Number((Number(query.get(name)) * 180 / Math.PI).toFixed(4)) : undefined));

const exported = (more) => ({ id, query, file }) => ['export', id, more, asked(query, 'format', 'unit', 'up', 'count', 'vertices', 'revision'), target(file)];

/* Method and path -> the words of groomctl's line, or { line }. ids stand in place of {id}. */
const COMMANDS = [
    ['POST', /^\/v1\/strands$/, upload('upload')],
    ['POST', /^\/v1\/heads$/, upload('upload-head')],
    ['POST', /^\/v1\/jobs$/, job],
    ['DELETE', /^\/v1\/jobs\/(\w+)$/, ({ id }) => ['cancel', id]],
    ['DELETE', /^\/v1\/(?:strands|heads|grooms)\/(\w+)$/, ({ id }) => ['delete', id]],
    ['POST', /^\/v1\/grooms$/, ({ file }) => ['import', file ?? 'groom.json']],
    ['PATCH', /^\/v1\/grooms\/(\w+)$/, patch],
    ['PUT', /^\/v1\/grooms\/(\w+)\/guides$/, ({ id, answer }) => ({
        line: `groomctl ${words('export', id, '--guides', flag('revision', answer?.revision), '-o', 'guides.data')} && groomctl ${words('set-guides', id, 'guides.data')}`,
    })],
    ['POST', /^\/v1\/grooms\/(\w+)\/revert$/, ({ id, body }) => ['revert', id, body.revision]],
    ...Object.keys(LAYER_FLAGS).map((kind) => ['POST', new RegExp(`^/v1/(?:grooms|strands)/(\\w+)/${kind}$`), layer(kind)]),
    ['GET', /^\/v1\/grooms\/(\w+)$/, ({ id, query, file }) => ['get', id, asked(query, 'revision'), target(file)]],
    ['GET', /^\/v1\/grooms\/(\w+)\/strands$/, exported([])],
    ['GET', /^\/v1\/grooms\/(\w+)\/guides$/, exported(['--guides'])],
    ['GET', /^\/v1\/strands\/(\w+)\/data$/, exported([])],
    ['GET', /^\/v1\/heads\/(\w+)\/data$/, ({ id, file }) => ['export', id, target(file)]],
    ['GET', /^\/v1\/grooms\/(\w+)\/preview\.png$/, ({ id, query, file }) => ['preview', id, asked(query, 'view', 'eye', 'target', 'distance', 'size', 'light', 'revision'), degrees(query, 'azimuth', 'elevation', 'fov'), target(file)]],
    ['GET', /^\/v1\/grooms\/(\w+)\/turntable\.png$/, ({ id, query, file }) => ['turntable', id, asked(query, 'frames', 'size', 'light', 'revision'),
        flag('seconds', query.has('frame_ms') ? Number(query.get('frame_ms')) * Number(query.get('frames') ?? 36) / 1000 : undefined), degrees(query, 'azimuth', 'elevation'), target(file)]],
    ['GET', /^\/v1\/(?:grooms|strands)\/(\w+)\/analysis$/, ({ id, query }) => ['analyze', id, asked(query, 'count', 'revision')]],
    ['GET', /^\/v1\/grooms\/(\w+)\/quality$/, ({ id, query }) => ['compare', id, query.get('with') ?? '', asked(query, 'revision')]],
];

function groomctl(call, origin) {
    for (const [method, pattern, make] of COMMANDS) {
        const found = method === call.method && pattern.exec(call.at);
        if (!found) continue;
        const made = make({ ...call, id: found[1] }), server = origin === DEFAULT_SERVER ? '' : `groomctl --server ${quoted(origin)}`;
        const line = made.line ?? `groomctl ${words(...made)}`;
        return server ? line.replaceAll(/(^|\| |&& )groomctl(?= )/g, `$1${server}`) : line;
    }
    return undefined;
}

/* --- curl --------------------------------------------------------------------------------------------- */

/* The session's cookie means nothing to a shell: there it is the token. */
const identity = (withToken) => (withToken ? ' -H "Authorization: Bearer $GROOMD_TOKEN"' : '');

function curl(call, origin, withToken) {
    const { method, path, body, type, headers, file, query } = call, parts = [];
    const match = headers?.['If-Match'];
    if (method === 'GET') return `curl${identity(withToken)} ${quoted(origin + path)} -o ${quoted(file ?? 'FILE')}`;
    if (match) parts.push('-H', `If-Match: ${match}`);
    if (/\/guides$/.test(call.at)) parts.push('--upload-file', 'guides.data');
    else if (['/v1/strands', '/v1/heads'].includes(call.at)) parts.push('--data-binary', `@${query.get('name') || file || 'FILE'}`);
    else if (body !== undefined && typeof body !== 'string') parts.push('-H', `Content-Type: ${type ?? 'application/json'}`, '-d', JSON.stringify(body));
    else if (call.at === '/v1/grooms') parts.push('-H', 'Content-Type: application/json', '--data-binary', `@${file ?? 'groom.json'}`);
    const verb = method === 'POST' && parts.some((part) => part.startsWith('--data') || part === '-d') ? [] : ['-X', method];
    if (method === 'PUT') verb.length = 0; /* what --upload-file does */
    const before = method === 'PUT' ? `${curl({ ...call, method: 'GET', path: `${call.at}?format=data&revision=${call.answer?.revision}`, file: 'guides.data' }, origin, withToken)} && ` : '';
    return `${before}curl${identity(withToken)} ${words(verb, parts, origin + whole(path))}`;
}

/* An upload in pieces ends with a call that names it; a shell sends the file at once. */
function whole(path) {
    const [at, query] = path.split('?'), kept = new URLSearchParams(query);
    kept.delete('upload');
    return kept.size ? `${at}?${kept}` : at;
}

/* --- both ------------------------------------------------------------------------------------------- */

const TITLES = [[/\/(ruffle|sculpt|interpolate|curl-scale|revert)$/, (m) => m[1].replace('-', ' ')], [/\/guides$/, () => 'guides'], [/preview\.png$/, () => 'picture'],
    [/turntable\.png$/, () => 'turntable'], [/\/(strands|data)$/, () => 'strands'], [/\/jobs$/, () => 'fit'], [/\/jobs\//, () => 'cancel'], [/^\/v1\/grooms$/, () => 'import']];

function titleOf({ method, at, body }) {
    if (body?.kind === 'retarget') return 'another head';
    if (method === 'DELETE' && !at.startsWith('/v1/jobs')) return 'remove';
    if (method === 'POST' && /^\/v1\/(strands|heads)$/.test(at)) return 'upload';
    if (method === 'PATCH') return 'edit';
    for (const [pattern, name] of TITLES) {
        const found = pattern.exec(at);
        if (found) return method === 'GET' && name() !== 'picture' && name() !== 'turntable' ? `export ${name(found)}` : name(found);
    }
    return method === 'GET' ? 'export document' : method.toLowerCase();
}

/**
 * A call of the page as { title, groomctl, curl }; null where it is none that a person meant (a try under the
 * hand, a look).
 * call  { method, path, body, type, headers, file, answer }: file names what is sent, or where the answer goes
 */
export function commandsOf(call, { origin = DEFAULT_SERVER, withToken = false } = {}) {
    const [at, query] = call.path.split('?'), whole_call = { ...call, at, query: new URLSearchParams(query) };
    if (call.body?.commit === false) return null;
    const line = groomctl(whole_call, origin);
    return line ? { title: titleOf(whole_call), groomctl: line, curl: curl(whole_call, origin, withToken) } : null;
}

/* --- those who want to know ---------------------------------------------------------------------------- */

export const told = new EventTarget();

/** A call has been answered: told to whoever shows commands. */
export const tell = (call) => told.dispatchEvent(new CustomEvent('call', { detail: call }));
