/* Server-sent events through fetch, which can carry a token as EventSource cannot: it goes on after the last
 * event that came where the line breaks. */

const AGAIN_MS = [500, 1000, 2000, 4000, 8000];

/* One event's lines: { id, name, data }. */
export function parse(block) {
    const event = { name: 'message', data: [] };
    for (const line of block.split('\n')) {
        const [, field, value] = /^([^:]*):? ?(.*)$/.exec(line);
        if (field === 'data') event.data.push(value);
        else if (field === 'event') event.name = value;
        else if (field === 'id') event.id = value;
    }
    return { ...event, data: event.data.join('\n') };
}

/* Calls on({ id, name, data }) for each event of a response. */
async function read(response, on) {
    const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let rest = '';;) {
        const { done, value } = await reader.read();
        if (done) return;
        const blocks = (rest + value).replaceAll('\r\n', '\n').split('\n\n');
        rest = blocks.pop();
        blocks.map(parse).filter((event) => event.data).forEach(on);
    }
}

/* request: fetch, or one that adds a token. Listens until the signal comes, or the stream is refused. */
export async function listen(path, request, signal, on) {
    let last, broken = 0;
    while (!signal.aborted) {
        try {
            const response = await request(path, { signal, headers: { Accept: 'text/event-stream', ...(last && { 'Last-Event-ID': last }) } });
            if (!response.ok) return;
            await read(response, ({ id, name, data }) => {
                broken = 0;
                last = id ?? last;
                if (!signal.aborted) on(name, JSON.parse(data));
            });
        } catch (error) {
            if (signal.aborted) return;
            if (!(error instanceof TypeError)) throw error;
        }
        await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS[Math.min(broken++, AGAIN_MS.length - 1)]); });
    }
}
