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
            node.append(this.choice("variant", "Variant", gallery.variantOf, gallery.variants));
        if (gallery.faults.size) node.append(this.damagedFilter());
        node.append(this.more, this.adder(), this.reset());
        for (const name of FIRST_FILTERS) if (gallery.measureOf.has(name)) this.add(name);
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

    /** Return a list of words to choose some of. */
    choice(name, title, numbers, words) {
        const boxes = words.map(() => element("input", { type: "checkbox", checked: true }));
        const apply = () => {
            const chosen = new Set(boxes.flatMap((box, place) => (box.checked ? [place] : [])));
            this.selection.setChoice(name, numbers, chosen.size === boxes.length ? null : chosen);
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
        this.shownFilters.set(name, {
            clear: () =>
                boxes.forEach((box) => {
                    box.checked = true;
                }),
            draw: () => {},
        });
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
        if (this.shownFilters.has(name) || !(this.gallery.measureOf.has(name) || this.gallery.files.has(name))) return;
        this.shownFilters.set(name, { clear: () => {}, draw: () => {} }); // it is on its way
        const column = await this.gallery.column(name).catch((fault) => this.refuse(name, fault));
        if (!column) return;
        const { numbers, words } = column;
        const title = this.gallery.title(name);
        if (words.length) {
            this.more.append(this.choice(name, title, numbers, words));
        } else {
            const filter = new RangeFilter(this.selection, name, title, this.gallery.unit(name), numbers);
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
        for (const name of [...this.gallery.measureOf.keys()])
            list.append(element("option", { value: name, label: this.gallery.title(name) }));
        for (const name of this.gallery.files.keys()) list.append(element("option", { value: name }));
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
        return element("div", {}, input, list);
    }

    reset() {
        const button = element("button", { type: "button" }, "Show all");
        button.addEventListener("click", () => {
            for (const filter of this.shownFilters.values()) filter.clear();
            this.name.value = "";
            if (this.damaged) this.damaged.checked = false;
            this.selection.clear();
        });
        return button;
    }

    draw() {
        for (const filter of this.shownFilters.values()) filter.draw();
    }
}
