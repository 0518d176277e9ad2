"use strict";
// Tags of pictures. The browser keeps them; tags.json, saved in the dataset's folder, takes them to others, to the next
// page, and to spin-usd export --tags.

const TAG_NAME = /^[^\s,]([^,\u0000-\u001f]{0,38}[^\s,])?$/;
const PICTURE_NAME = /^[a-z0-9_]+(-[a-z0-9_]+)?\/(?!.*\.tmp-)[A-Za-z0-9][A-Za-z0-9._-]{0,199}$/;
const TAGS_SCHEMA = "tags-1";

class Tags extends EventTarget {
    constructor(gallery) {
        super();
        this.gallery = gallery;
        this.key = `spin_usd tags of ${gallery.dataset} at ${location.pathname}`; // pages on a disk share one store
        this.of = new Map(); // Set of pictures, VARIANT/FRAME, by tag; of pictures that are not here too
        this.take(gallery.tags);
        this.recall();
        addEventListener("storage", (event) => {
            if (event.key === this.key) this.recall();
        });
    }

    get names() {
        return [...this.of.keys()]; // as they came, so that each keeps its key
    }

    picture(row) {
        return `${this.gallery.variant(row)}/${this.gallery.frame(row)}`;
    }

    has(name, row) {
        return this.of.get(name)?.has(this.picture(row)) ?? false;
    }

    /** Return the tags of the row. */
    tagsOf(row) {
        return this.names.filter((name) => this.has(name, row));
    }

    /** Return the rows that have one of these tags. */
    rows(names) {
        const rows = new Set();
        for (const name of names) {
            for (const picture of this.of.get(name) ?? []) {
                const [variant, frame] = picture.split("/");
                const row = this.gallery.rowOf(frame, variant);
                if (row !== undefined) rows.add(row);
            }
        }
        return rows;
    }

    /** Have a tag of that name; return the name, null where no tag can be called so. */
    add(text) {
        const name = text.trim();
        if (!TAG_NAME.test(name)) return null;
        if (!this.of.has(name)) this.of.set(name, new Set());
        this.changed();
        return name;
    }

    /** Give these rows the tag, or take it from them. */
    set(name, rows, on) {
        const pictures = this.of.get(name);
        for (const row of rows) pictures[on ? "add" : "delete"](this.picture(row));
        this.changed();
    }

    toggle(name, row) {
        this.set(name, [row], !this.has(name, row));
    }

    changed() {
        this.keep();
        this.dispatchEvent(new Event("change"));
    }

    /** Take these tags beside those that there are: pictures by tag, as a file has them. What is none is left out. */
    take(found) {
        for (const [name, pictures] of Object.entries(found)) {
            if (!TAG_NAME.test(name) || !Array.isArray(pictures)) continue;
            const held = this.of.get(name) ?? new Set();
            for (const picture of pictures) if (PICTURE_NAME.test(picture)) held.add(picture);
            if (held.size) this.of.set(name, held);
        }
    }

    /** Return the pictures by tag, as a file has them; tags of none are left out. */
    asJson() {
        const used = this.names.filter((name) => this.of.get(name).size);
        return Object.fromEntries(used.map((name) => [name, [...this.of.get(name)].sort()]));
    }

    /** Be what the browser keeps. Where the dataset's own file is another than it was then, both count: no mark is
     * lost. */
    recall() {
        let kept = null;
        try {
            kept = JSON.parse(localStorage.getItem(this.key));
        } catch {
            return; // the browser keeps nothing for pages
        }
        if (typeof kept?.tags !== "object" || kept.tags === null) return;
        if (kept.file === JSON.stringify(this.gallery.tags)) this.of.clear();
        this.take(kept.tags);
        this.dispatchEvent(new Event("change"));
    }

    keep() {
        try {
            const kept = { file: JSON.stringify(this.gallery.tags), tags: this.asJson() };
            localStorage.setItem(this.key, JSON.stringify(kept));
        } catch {
            this.fault("The browser keeps no tags: save them before you close the page");
        }
    }

    fault(message) {
        this.dispatchEvent(new CustomEvent("fault", { detail: new Error(message) }));
    }

    /** Let the user save tags.json. */
    save() {
        const said = { schema: TAGS_SCHEMA, dataset: this.gallery.dataset, tags: this.asJson() };
        const file = new Blob([`${JSON.stringify(said, null, 1)}\n`], { type: "application/json" });
        const href = URL.createObjectURL(file);
        element("a", { href, download: "tags.json" }).click();
        setTimeout(() => URL.revokeObjectURL(href), 1000);
    }

    /** Take the tags of a file that the user chose. */
    async load(file) {
        try {
            const said = JSON.parse(await file.text());
            if (said?.schema !== TAGS_SCHEMA || typeof said.tags !== "object" || said.tags === null) throw new Error();
            this.take(said.tags);
            this.changed();
        } catch {
            this.fault(`${file.name} holds no tags`);
        }
    }
}
