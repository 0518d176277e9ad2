"use strict";
// What the grid's side bar and the side of a picture have of the tags.

/** The tags in the side bar: to filter by, to mark with, to save and load. */
class TagPanel {
    constructor(tags, selection, grid) {
        Object.assign(this, { tags, selection, grid });
        this.list = element("div", { className: "tags" });
        const files = element("input", { type: "file", accept: ".json", hidden: true, "aria-label": "A tags.json" });
        files.addEventListener("change", () => {
            if (files.files.length) tags.load(files.files[0]);
            files.value = "";
        });
        const buttons = element(
            "div",
            { className: "row" },
            pressable("Save…", "Save tags.json; put it into the dataset's folder", () => tags.save()),
            pressable("Load…", "Take the tags of a tags.json too", () => files.click()),
            pressable("Copy these frames", "Copy what chooses the pictures that are shown", () => this.copy()),
            files,
        );
        this.copied = element("div");
        selection.addEventListener("change", () => this.copied.replaceChildren());
        const legend = element("legend", {}, "Tags");
        this.node = element("fieldset", {}, legend, this.list, newTag(tags, () => {}), buttons, this.copied);
        for (const source of [tags, selection, grid]) source.addEventListener("change", () => this.draw());
        this.draw();
    }

    draw() {
        const { tags, selection, grid } = this;
        const rows = tags.names.map((name, place) => {
            const box = element("input", { type: "checkbox", checked: selection.tags.has(name) });
            box.setAttribute("aria-label", `Only with the tag ${name}`);
            box.addEventListener("change", () => selection.setTag(name, box.checked));
            const pen = pressable("✎", `Mark with ${name} by clicking pictures`, () => {
                grid.setPen(grid.pen === name ? null : name);
            });
            pen.setAttribute("aria-pressed", grid.pen === name);
            const count = element("span", { className: "count" }, String(tags.of.get(name).size));
            const words = element("span", { className: "word" }, name);
            const label = element("label", { className: "check" }, box, words, count, keyOf(place));
            return element("div", { className: "tag" }, label, pen);
        });
        this.list.replaceChildren(...rows);
        if (!rows.length) this.list.append(element("p", { className: "hint" }, "Name one, then press its number."));
    }

    async copy() {
        const text = await chooserOf(this.tags.gallery, this.selection.rows);
        if (text === null) return this.tags.fault("These pictures have no short name: tag them, and export --tags");
        const block = copyable(text);
        this.copied.replaceChildren(block);
        block.querySelector("button").click();
    }
}

/** The tags of one picture, each to be pressed. */
class PictureTags {
    constructor(tags) {
        Object.assign(this, { tags, row: null });
        this.list = element("div", { className: "chips" });
        const added = newTag(tags, (name) => tags.set(name, [this.row], true));
        this.node = element("div", { className: "tagging" }, this.list, added);
        tags.addEventListener("change", () => this.draw());
    }

    show(row) {
        this.row = row;
        this.draw();
    }

    draw() {
        if (this.row === null) return;
        const chips = this.tags.names.map((name, place) => {
            const chip = pressable(name, `Tag ${name}`, () => this.tags.toggle(name, this.row));
            chip.append(" ", keyOf(place));
            chip.setAttribute("aria-pressed", this.tags.has(name, this.row));
            return chip;
        });
        this.list.replaceChildren(...chips);
    }
}

function pressable(text, title, act) {
    const button = element("button", { type: "button", title, "aria-label": title }, text);
    button.addEventListener("click", act);
    return button;
}

/** Return the key that gives the tag at that place; "" where none is left. */
function keyOf(place) {
    return place < 9 ? element("kbd", {}, String(place + 1)) : "";
}

/** Return the field for a new tag's name; `then` takes the name. */
function newTag(tags, then) {
    const words = { placeholder: "New tag…", "aria-label": "A new tag" };
    const input = element("input", { type: "text", maxLength: 40, ...words });
    input.addEventListener("keydown", (event) => {
        if (event.key === "Escape") input.blur();
        if (event.key !== "Enter") return;
        const name = tags.add(input.value);
        if (name === null) return tags.fault("A tag is a word or a few, without a comma");
        input.value = "";
        then(name);
    });
    return input;
}
