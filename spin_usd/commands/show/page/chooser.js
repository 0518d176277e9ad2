"use strict";
// What chooses the same pictures elsewhere: options of spin-usd export, or a condition of Dataset.where.

const MOST_CHARACTERS = 2000; // that a condition may have

/** Return a promise of the text that chooses these rows; null where there is none that is short enough. */
async function chooserOf(gallery, rows) {
    const framesOf = new Map(); // those shown, in order, by variant
    for (const row of Uint32Array.from(rows).sort()) {
        const variant = gallery.variantOf[row];
        if (!framesOf.has(variant)) framesOf.set(variant, []);
        framesOf.get(variant).push(gallery.frameOf[row]);
    }
    const groups = new Map(); // variants of which the same frames are shown, by these
    for (const [variant, frames] of framesOf) {
        const key = frames.sort((a, b) => a - b).join();
        groups.set(key, { frames, variants: [...(groups.get(key)?.variants ?? []), variant] });
    }
    const [first, ...others] = groups.values();
    const slice = first && !others.length ? await sliceOf(gallery, first) : null;
    if (slice !== null) return optionsOf(gallery, slice, first.variants);
    const condition = [...groups.values()].map((group) => conditionOf(gallery, group)).join(" or ");
    if (!condition || condition.length > MOST_CHARACTERS) return null;
    return `Dataset(${inPython(gallery.given)}).where(${inPython(condition)})`;
}

/** Return the options of export. */
function optionsOf(gallery, slice, variants) {
    const names = variants.map((variant) => quoted(gallery.variants[variant])).join(",");
    const all = names && variants.length === gallery.variants.length;
    return [slice && `--frames ${slice}`, all ? "--variants all" : `--variants ${names}`].filter(Boolean).join(" ");
}

function conditionOf(gallery, { frames, variants }) {
    const among = (names) => (names.length > 1 ? `in [${names.map(inPython).join(", ")}]` : `== ${inPython(names[0])}`);
    const frame = `frame ${among(frames.map((each) => gallery.frames[each]))}`;
    if (variants.length === gallery.variants.length) return frame;
    return `variant ${among(variants.map((each) => gallery.variants[each]))} and ${frame}`;
}

/** Return the text as Python writes it. */
function inPython(text) {
    const plain = !text.includes("'") && !text.includes("\\");
    return plain && text.includes('"') ? `'${text}'` : JSON.stringify(text);
}

/** Return a promise of the slice A:B:STEP, counted as export counts, that has these frames of these variants; "" for
 * all, null where there is none. */
async function sliceOf(gallery, { frames, variants }) {
    const places = gallery.has("index") ? (await gallery.column("index")).numbers : gallery.frameOf; // in the stage
    const placeOf = new Map(); // by frame
    for (let row = 0; row < gallery.count; row += 1)
        if (variants.includes(gallery.variantOf[row])) placeOf.set(gallery.frameOf[row], places[row]);
    const sorted = [...new Set(placeOf.values())].sort((a, b) => a - b);
    const numberOf = new Map(sorted.map((place, number) => [place, number]));
    const numbers = frames.map((frame) => numberOf.get(placeOf.get(frame))).sort((a, b) => a - b);
    if (numbers.length === sorted.length) return "";
    const step = numbers.length > 1 ? numbers[1] - numbers[0] : 1;
    if (step < 1 || numbers.some((number, at) => number !== numbers[0] + at * step)) return null;
    return `${numbers[0]}:${numbers.at(-1) + 1}${step > 1 ? `:${step}` : ""}`;
}
