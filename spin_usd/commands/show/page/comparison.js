"use strict";
// The same picture of another dataset: beside this one, in its place, or both by turns; and which values differ.

const BLINK_MS = 700;
const MODES = [
    { name: "own", text: "This", title: "This dataset alone", key: "e" },
    { name: "both", text: "Both", title: "Both datasets side by side", key: "w" },
    { name: "other", text: "Other", title: "The other dataset alone", key: "e" },
    { name: "blink", text: "Blink", title: "Both datasets by turns", key: "r" },
];

class Comparison {
    /** addSheet: makes the place for the other picture, once it is asked for. */
    constructor(gallery, sheet, addSheet) {
        Object.assign(this, { gallery, sheet, addSheet, mode: "own", row: null, own: null, found: null, other: null });
        this.caption(sheet, gallery.dataset);
        const buttons = MODES.map(({ name, text, title, key }) => {
            const button = pressable(text, title, () => this.set(name));
            button.append(" ", element("kbd", {}, key));
            button.dataset.mode = name;
            return button;
        });
        this.buttons = element("div", { className: "modes", role: "group", "aria-label": "Beside" }, ...buttons);
        this.differences = element("div");
        const title = element("h3", {}, `Beside ${gallery.beside.dataset}`);
        this.node = element("div", {}, title, this.buttons, this.differences);
        this.show();
    }

    caption(sheet, text) {
        sheet.stage.node.append(element("p", { className: "caption" }, text));
    }

    /** Answer a letter; return whether it is one of these. */
    key(key) {
        const next = { e: this.mode === "other" ? "own" : "other", w: "both", r: "blink" }[key];
        if (next) this.set(next === this.mode ? "own" : next);
        return next !== undefined;
    }

    set(mode) {
        this.mode = mode;
        if (mode !== "own" && !this.other) this.addOther();
        this.show();
    }

    addOther() {
        this.other = this.addSheet();
        this.caption(this.other, this.gallery.beside.dataset);
        const [a, b] = [this.sheet.stage, this.other.stage];
        a.addEventListener("zoom", () => b.follow(a));
        b.addEventListener("zoom", () => a.follow(b));
        this.fill();
    }

    /** Show what the mode says: of blinking, the other picture every second time. */
    show(turn = false) {
        const { mode } = this;
        clearTimeout(this.next);
        if (mode === "blink") this.next = setTimeout(() => this.show(!turn), BLINK_MS);
        const other = mode === "both" || mode === "other" || (mode === "blink" && turn);
        this.sheet.stage.node.classList.toggle("away", other && mode !== "both");
        this.other?.stage.node.classList.toggle("away", !other);
        this.sheet.stage.node.parentElement.classList.toggle("both", mode === "both");
        this.sheet.stage.node.parentElement.classList.toggle("compared", mode !== "own");
        for (const button of this.buttons.children) button.setAttribute("aria-pressed", button.dataset.mode === mode);
    }

    /** Show the picture that is called as that of the row, of which `own` is what is known. */
    async open(row, own) {
        this.row = row;
        const found = await this.gallery.besides(row).catch(() => null);
        await this.other?.stage.preload(found?.files.image);
        if (this.row !== row) return; // another one was opened meanwhile
        Object.assign(this, { own, found });
        this.show();
        await this.fill();
    }

    /** Show nothing, and blink no more. */
    clear() {
        this.row = null;
        clearTimeout(this.next);
        this.other?.clear();
    }

    async fill() {
        const { own, found, other } = this;
        const differ = own && found ? differingValues(own.record, found.record) : [];
        this.differences.replaceChildren(...this.sections(differ));
        if (!other) return;
        other.take(found);
        const labels = await other.labelsOf(found).catch(() => null);
        const events = await other.eventsOf(found).catch(() => null);
        if (this.found === found) {
            other.takeLabels(labels);
            other.takeEvents(events);
        }
        other.stage.follow(this.sheet.stage);
    }

    sections(differ) {
        if (!this.found) return [element("p", { className: "hint" }, "It has no picture of this name.")];
        const usual = differ.filter(([name]) => !isSeldom(name));
        const seldom = differ.filter(([name]) => isSeldom(name));
        const names = [this.gallery.dataset, this.gallery.beside.dataset];
        const open = this.differences.querySelector("details")?.open ?? false; // as it was for the picture before
        const found = section(`Values that differ (${differ.length})`, open, comparedTable(names, usual));
        if (seldom.length) found.append(section(`${seldom.length} more`, false, comparedTable(names, seldom)));
        return [found];
    }
}

/** Return a table of [name, own, other], and whose these are. */
function comparedTable(names, rows) {
    const head = ["", ...names].map((name) => element("th", { scope: "col" }, name));
    const body = rows.map(([name, ...values]) =>
        element(
            "tr",
            {},
            element("th", { scope: "row" }, name),
            ...values.map((value) => element("td", {}, typeof value === "string" ? value : shown(value))),
        ),
    );
    const parts = [element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...body)];
    return element("table", { className: "facts compared" }, ...parts);
}

/** Return [name, own, other] of each value of the records in which they differ, by names such as targets[0].range;
 * digests, which say nothing to people, are left out. */
function differingValues(own, other) {
    const [ours, theirs] = [own, other].map((record) => new Map(leavesOf(record)));
    const names = [...new Set([...ours.keys(), ...theirs.keys()])];
    return names.flatMap((name) => {
        const [a, b] = [ours.get(name), theirs.get(name)];
        return a === b || [a, b].some((value) => /^[0-9a-f]{64}$/.test(value)) ? [] : [[name, a, b]];
    });
}

function leavesOf(value, name = "") {
    if (typeof value !== "object" || value === null) return [[name, value]];
    const list = Array.isArray(value);
    return Object.entries(value).flatMap(([key, inner]) =>
        leavesOf(inner, list ? `${name}[${key}]` : name ? `${name}.${key}` : key),
    );
}
