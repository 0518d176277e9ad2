"use strict";
// What the index says of all pictures. A row is a picture's place in the dataset.

class Gallery {
    constructor({ header, arrays }) {
        Object.assign(this, header);
        this.frameOf = arrays.get("frame");
        this.variantOf = arrays.get("variant");
        this.keys = arrays.get("image");
        this.numbers = arrays;
        this.files = new Map(header.columns.map((column) => [column.name, column.file]));
        this.measureOf = new Map(header.measures.map((measure) => [measure.name, measure]));
        this.classes = classesOf(header);
        this.faults = new Map(Object.entries(header.faults).map(([row, fault]) => [Number(row), fault]));
    }

    frame(row) {
        return this.frames[this.frameOf[row]];
    }

    variant(row) {
        return this.variants[this.variantOf[row]];
    }

    /** Return the name of the picture's thumbnail, or that of its targets alone; null where there is none. */
    thumbnail(row, ofTarget) {
        const bytes = this.keys.subarray(8 * row, 8 * row + 8);
        if (bytes.every((byte) => byte === 0)) return null;
        const key = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
        return `thumbnails/${key.slice(0, 2)}/${key}${ofTarget ? "_target" : ""}.jpg`;
    }

    /** Return the rows of all variants of the row's frame, in the order of variants. */
    variantsOf(row) {
        this.rowsOfFrame ??= this.byFrame();
        return this.rowsOfFrame[this.frameOf[row]];
    }

    byFrame() {
        const rows = this.frames.map(() => []);
        for (let row = 0; row < this.count; row += 1) rows[this.frameOf[row]].push(row);
        const order = alphabetically(this.variants);
        for (const each of rows) each.sort((a, b) => order[this.variantOf[a]] - order[this.variantOf[b]]);
        return rows;
    }

    /** Return the row of that frame and variant; undefined where there is none. */
    rowOf(frame, variant) {
        this.placeOfFrame ??= new Map(this.frames.map((name, place) => [name, place]));
        this.rowsOfFrame ??= this.byFrame();
        return this.rowsOfFrame[this.placeOfFrame.get(frame)]?.find((row) => this.variant(row) === variant);
    }

    /** Return whether the pictures differ in that measure. */
    varies(name) {
        const span = this.measureOf.has(name) && extent(this.numbers.get(name));
        return Boolean(span) && span[0] < span[1];
    }

    /** Return whether there is a column of that name. */
    has(name) {
        return name === "variant" || this.measureOf.has(name) || this.files.has(name);
    }

    /** Return a promise of the column: its numbers, and the words that they stand for, none for plain numbers. */
    async column(name) {
        if (name === "variant") return { numbers: this.variantOf, words: this.variants };
        if (this.measureOf.has(name)) return { numbers: this.numbers.get(name), words: [] };
        const { header, arrays } = await loadData(this.files.get(name));
        return { numbers: arrays.get("numbers"), words: header.words };
    }

    /** Return what people call a column. */
    title(name) {
        const measure = this.measureOf.get(name);
        if (!measure) return name;
        const several = measure.target !== null && this.targets.length > 1;
        return several ? `${measure.title} of ${measure.target}` : measure.title;
    }

    unit(name) {
        return this.measureOf.get(name)?.unit ?? "";
    }

    /** Return the measure's value of that row, with its unit. */
    value(name, row) {
        const numbers = this.numbers.get(name);
        return numbers ? `${shown(numbers[row], 4)} ${this.unit(name)}`.trim() : "";
    }

    /** What is known of the dataset beside, as far as its pictures need it. */
    get other() {
        return { ...this.beside, classes: classesOf(this.beside) };
    }

    /** Return a promise of what is known of the picture of the same name in the dataset beside; null for none. */
    async besides(row) {
        const place = this.numbers.get("place beside")[row];
        return place < 0 ? null : pictureAt(this.beside.records, this.per_file, place);
    }

    /** Return a promise of what the row's record file says: record, files, lens_limit; null for a damaged one. */
    async picture(row) {
        return pictureAt(this.records, this.per_file, row);
    }
}

async function pictureAt(files, perFile, place) {
    const { header } = await loadData(files[Math.floor(place / perFile)]);
    const found = header.pictures[place % perFile];
    return found.record ? found : null;
}

/** Return the names of the parts' classes, in the order of their ids. */
function classesOf({ parts }) {
    return [...new Set(Object.values(parts).map(([, name]) => name))].sort();
}

/** Return the place of each name among all: nominal first, and 2 before 10. */
function alphabetically(names) {
    const sorted = names.map((name, place) => [name, place]);
    sorted.sort(([a], [b]) => (b === "nominal") - (a === "nominal") || a.localeCompare(b, "en", { numeric: true }));
    const order = new Uint32Array(names.length);
    sorted.forEach(([, place], rank) => {
        order[place] = rank;
    });
    return order;
}

/** Return whether few look for that value: a number among others, what made the picture, or the next frame's. */
function isSeldom(name) {
    return /^(next|provenance)\.|\]$/.test(name);
}

/** Return the column's numbers to sort by: of words, their places in the alphabet. */
function inOrder({ numbers, words }) {
    if (!words.length) return numbers;
    const order = alphabetically(words);
    return Float32Array.from(numbers, (number) => (number < 0 ? NaN : order[number]));
}
