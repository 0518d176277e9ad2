"use strict";
// The side bar: what pictures must be like to be shown.

const FIRST_FILTERS = ["range@1", "sun@1", "visible@1", "brightness"];

class Filters extends EventTarget {
    constructor(gallery, selection, node) {
        super();
        Object.assign(this, { gallery, selection, node, shownFilters: new Map() });
        this.more = element("div");
        node.append(this.nameFilter());
        if (gallery.variants.length > 1)
            node.append(this.choice("variant", "Variant", { numbers: gallery.variantOf, words: gallery.variants }));
        if (gallery.faults.size) node.append(this.damagedFilter());
        node.append(this.more, this.adder(), this.reset());
        for (const name of FIRST_FILTERS) if (gallery.varies(name)) this.add(name);
        selection.addEventListener("change", () => this.draw());
    }

    nameFilter() {
        const input = element("input", {
            type: "search",
            placeholder: "Frame name",
            "aria-label": "Part of the frame's name",
        });
        input.addEventListener("input", () => {
            this.selection.text = input.value.toLowerCase();
            this.selection.update();
        });
        this.name = input;
        return input;
    }

    damagedFilter() {
        const box = element("input", { type: "checkbox" });
        box.addEventListener("change", () => {
            this.selection.damagedOnly = box.checked;
            this.selection.update();
        });
        this.damaged = box;
        return element("label", { className: "check" }, box, ` Damaged only (${this.gallery.faults.size})`);
    }

    /** Return a list of the column's words to choose some of. */
    choice(name, title, column) {
        const { words } = column;
        const boxes = words.map(() => element("input", { type: "checkbox", checked: true }));
        const apply = () => {
            const chosen = new Set(boxes.flatMap((box, place) => (box.checked ? [place] : [])));
            this.selection.setChoice(name, column, chosen.size === boxes.length ? null : chosen);
        };
        const all = (checked) => () => {
            for (const box of boxes) box.checked = checked;
            apply();
        };
        const button = (text, checked) => {
            const found = element("button", { type: "button", className: "link" }, text);
            found.addEventListener("click", all(checked));
            return found;
        };
        const list = element("div", { className: "choices" });
        const order = alphabetically(words);
        const places = [...words.keys()].sort((a, b) => order[a] - order[b]);
        for (const place of places) {
            boxes[place].addEventListener("change", apply);
            list.append(element("label", { className: "check" }, boxes[place], ` ${words[place]}`));
        }
        const draw = () => {
            const chosen = this.selection.choices.get(name)?.chosen;
            boxes.forEach((box, place) => {
                box.checked = chosen?.has(place) ?? true;
            });
        };
        draw();
        this.shownFilters.set(name, { draw });
        return element(
            "fieldset",
            {},
            element("legend", {}, title),
            button("all", true),
            " ",
            button("none", false),
            list,
        );
    }

    /** Add a filter by the column of that name. */
    async add(name) {
        if (this.shownFilters.has(name) || !this.gallery.has(name)) return;
        this.shownFilters.set(name, { draw: () => {} }); // it is on its way
        const column = await this.gallery.column(name).catch((fault) => this.refuse(name, fault));
        if (!column) return;
        const title = this.gallery.title(name);
        if (column.words.length) {
            this.more.append(this.choice(name, title, column));
        } else {
            const filter = new RangeFilter(this.selection, name, title, this.gallery.unit(name), column.numbers);
            this.shownFilters.set(name, filter);
            this.more.append(filter.node);
        }
    }

    /** Say that there is no such filter; it may be asked for again. */
    refuse(name, fault) {
        this.shownFilters.delete(name);
        this.dispatchEvent(new CustomEvent("fault", { detail: fault }));
    }

    /** Return the means to filter by any other value of the records. */
    adder() {
        const list = element("datalist", { id: "values" });
        const offer = (names) => list.append(...names.map((name) => element("option", { value: name })));
        const measures = [...this.gallery.measureOf.keys()].filter((name) => this.gallery.varies(name));
        const names = [...this.gallery.files.keys()];
        list.append(...measures.map((name) => element("option", { value: name, label: this.gallery.title(name) })));
        offer(names.filter((name) => !isSeldom(name)));
        const input = element("input", {
            type: "text",
            list: "values",
            placeholder: "Filter by another value…",
            "aria-label": "A value of the records to filter by",
        });
        input.addEventListener("change", () => {
            this.add(input.value);
            input.value = "";
        });
        const offerMore = () => offer(names.filter(isSeldom));
        input.addEventListener("input", offerMore, { once: true }); // someone looks for more
        return element("div", {}, input, list);
    }

    reset() {
        const button = element("button", { type: "button" }, "Show all");
        button.addEventListener("click", () => this.selection.clear());
        return button;
    }

    /** Show what the selection is; what it filters by has its filter then. */
    draw() {
        const { text, damagedOnly, ranges, choices } = this.selection;
        if (this.name.value.toLowerCase() !== text) this.name.value = text;
        if (this.damaged) this.damaged.checked = damagedOnly;
        for (const name of [...ranges.keys(), ...choices.keys()]) this.add(name);
        for (const filter of this.shownFilters.values()) filter.draw();
    }
}
