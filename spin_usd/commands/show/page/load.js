"use strict";
// Data files are scripts that call giveData: a page that was opened from a disk may load nothing else than scripts.

const waiting = new Map(); // what is to be called with a file's text, by the file's key
const loaded = new Map(); // promises of content by file; the least used first
const sizes = new Map(); // bytes of those that are there, by file
const MOST_BYTES = 2 ** 28; // label data of a large picture take some 30 MB

function giveData(key, text) {
    waiting.get(key)?.(text);
}

/** Return a promise of the data file's { header, arrays }. */
function loadData(file) {
    const found = loaded.get(file) ?? requestData(file);
    loaded.delete(file);
    loaded.set(file, found);
    return found;
}

/** Forget the least used files until those that are there take no more than MOST_BYTES. */
function forget() {
    let held = [...sizes.values()].reduce((sum, each) => sum + each, 0);
    for (const file of [...loaded.keys()].filter((each) => sizes.has(each))) {
        if (held <= MOST_BYTES) return;
        held -= sizes.get(file);
        loaded.delete(file);
        sizes.delete(file);
    }
}

async function requestData(file) {
    const key = file.split("/").at(-1).replace(".js", "");
    const script = document.createElement("script");
    try {
        const text = await new Promise((resolve, reject) => {
            waiting.set(key, resolve);
            script.onerror = () => reject(new Error(`${file} is missing`));
            script.onload = () => reject(new Error(`${file} is damaged`)); // it would have called giveData by now
            script.src = file;
            document.head.append(script);
        });
        const bytes = await inflated(text);
        sizes.set(file, bytes.byteLength);
        forget();
        return unpacked(bytes);
    } catch (fault) {
        loaded.delete(file);
        sizes.delete(file);
        throw fault;
    } finally {
        waiting.delete(key);
        script.remove();
    }
}

/** Return the bytes that zlib has packed into the base64 text. */
async function inflated(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
}

const ARRAY_TYPES = {
    uint8: Uint8Array,
    uint16: Uint16Array,
    uint32: Uint32Array,
    int32: Int32Array,
    float32: Float32Array,
    float64: Float64Array,
};

/** Return the JSON header and the arrays that it places: see DataFile in data_file.py. */
function unpacked(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    const arrays = new Map();
    for (const [name, place] of Object.entries(header.arrays)) {
        arrays.set(name, new ARRAY_TYPES[place.dtype](buffer, 4 + length + place.offset, place.length));
    }
    return { header, arrays };
}
