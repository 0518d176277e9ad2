"use strict";
// One picture large: its image, what lies over it, and what is known of it.

class PictureView extends EventTarget {
    constructor(gallery, selection, tags, stageNode, side) {
        super();
        this.tagging = new PictureTags(tags);
        Object.assign(this, { gallery, selection, side, row: null, node: stageNode });
        this.overlays = new Overlays(gallery);
        this.sheet = this.addSheet(gallery);
        const addOther = () => this.addSheet(gallery.other);
        this.comparison = gallery.beside ? new Comparison(gallery, this.sheet, addOther) : null;
        this.buildSide();
    }

    /** Add a place for a picture of the gallery; the pointer's values are of the one that it is over. */
    addSheet(gallery) {
        const node = element("div", { className: "sheet" });
        this.node.append(node);
        const sheet = new Sheet(node, gallery, this.overlays);
        node.addEventListener("pointermove", (event) => this.point(sheet.stage.position(event), sheet));
        node.addEventListener("pointerleave", () => this.point(null));
        return sheet;
    }

    get stage() {
        return this.sheet.stage;
    }

    buildSide() {
        const button = (text, label, act) => {
            const found = element("button", { type: "button", "aria-label": label, title: label }, text);
            found.addEventListener("click", act);
            return found;
        };
        this.title = element("h2");
        this.place = element("p", { className: "place" });
        const steps = element(
            "div",
            { className: "tools" },
            button("←", "Previous picture", () => this.step(-1)),
            button("→", "Next picture", () => this.step(1)),
            button("⊙", "Zoom to the target", () => this.zoomToTargets()),
            button("⤢", "Show all of the picture", () => this.stage.fit()),
            button("✕", "Back to the grid", () => this.dispatchEvent(new Event("close"))),
        );
        this.pointer = element("div", { className: "pointer", "aria-live": "off" });
        this.slider = element("input", { type: "range", min: 0, step: 1, "aria-label": "Variant of this frame" });
        this.slider.addEventListener("input", () => this.go(this.gallery.variantsOf(this.row)[this.slider.value]));
        this.variant = element("output");
        this.variants = element(
            "div",
            { className: "variants" },
            element("label", {}, "Variant ", this.variant, this.slider),
        );
        this.about = element("div");
        this.side.append(
            element("header", {}, this.title, steps),
            this.place,
            this.tagging.node,
            this.variants,
            ...(this.comparison ? [this.comparison.node] : []),
            element("h3", {}, "Overlays"),
            this.overlays.controls,
            element("h3", {}, "Under the pointer"),
            this.pointer,
            this.about,
        );
    }

    /** Show the targets' boxes large. */
    zoomToTargets() {
        const boxes = (this.sheet.shown?.record.targets ?? [])
            .map((target) => target.box.visible ?? target.box.amodal)
            .filter(Boolean);
        if (!boxes.length) return;
        const least = (axis) => Math.min(...boxes.map((box) => box[axis]));
        const most = (axis) => Math.max(...boxes.map((box) => box[axis]));
        this.stage.show([least(0), least(1), most(2), most(3)]);
    }

    /** Ask for the picture of that row in place of this one. */
    go(row) {
        if (row !== undefined) this.dispatchEvent(new CustomEvent("go", { detail: row }));
    }

    /** Go so many pictures on in the selection. */
    step(by) {
        const place = this.selection.rows.indexOf(this.row);
        this.go(this.selection.rows[place + by]);
    }

    /** Go so many variants on of the same frame. */
    stepVariant(by) {
        const rows = this.gallery.variantsOf(this.row);
        this.go(rows[rows.indexOf(this.row) + by]);
    }

    /** Show the picture of that row as soon as its image is there; until then the one before stays whole. */
    async open(row) {
        this.row = row;
        delete this.node.dataset.shown;
        const faults = [this.gallery.faults.get(row)].filter(Boolean);
        const found = await this.gallery.picture(row).catch((fault) => void faults.push(fault.message));
        await this.stage.preload(found?.files.image);
        if (this.row !== row) return; // another one was opened meanwhile
        this.take(found ?? null, faults);
        this.comparison?.open(row, found ?? null);
        const labels = await this.sheet
            .labelsOf(found)
            .catch((fault) => void (faults.length || faults.push(fault.message)));
        if (this.row !== row) return;
        this.takeLabels(labels ?? null, faults);
        const events = await this.sheet
            .eventsOf(found)
            .catch((fault) => void (faults.length || faults.push(fault.message)));
        if (this.row !== row) return;
        this.sheet.takeEvents(events ?? null);
        this.sayFaults(faults);
        this.node.dataset.shown = `${this.gallery.variant(row)}/${this.gallery.frame(row)}`;
    }

    /** Show nothing, so that the next picture does not begin with this one. */
    clear() {
        this.sheet.clear();
        this.comparison?.clear();
        this.title.textContent = this.place.textContent = "";
        this.about.replaceChildren();
    }

    /** Show all that is known of the row's picture without its labels. */
    take(found, faults) {
        this.sheet.take(found);
        this.sayFaults(faults);
        this.sayPlace();
        this.tagging.show(this.row);
        this.about.replaceChildren(...this.sections(found?.record));
        this.point(null);
    }

    takeLabels(labels, faults) {
        this.sheet.takeLabels(labels);
        if (labels && !this.sheet.shown.files.image) this.overlays.showOne(labels);
        this.sayFaults(faults);
        this.point(null);
    }

    sayFaults(faults) {
        this.stage.fault.hidden = faults.length === 0;
        this.stage.fault.textContent = faults.length ? `Damaged: ${faults.join("; ")}` : "";
    }

    /** Say which picture it is. */
    sayPlace() {
        const { gallery, row } = this;
        const rows = gallery.variantsOf(row);
        this.title.textContent = gallery.frame(row);
        this.place.textContent = `${this.selection.rows.indexOf(row) + 1} of ${this.selection.rows.length} shown`;
        this.variants.hidden = rows.length < 2;
        this.slider.max = rows.length - 1;
        this.slider.value = rows.indexOf(row);
        this.variant.textContent = gallery.variant(row);
    }

    /** Return what the side says of the row's picture; record: undefined for a damaged one. */
    sections(record) {
        const parts = [
            section("Reproduce", true, copyable(reproduceCommand(this.gallery, this.row))),
            section("Measures", true, measureTable(this.gallery, this.row)),
        ];
        if (record)
            parts.push(
                ...provenance(record),
                section("Record", false, ...Object.entries(record).map(([key, value]) => tree(key, value))),
            );
        return parts;
    }

    /** Say what is at that place of the picture, [u, v] in pixels; null where the pointer is elsewhere. */
    point(at, { shown, labels, gallery } = this.sheet) {
        const pixel = at && shown ? at.map(Math.floor) : null;
        const rows = factsAt(labels, gallery, pixel);
        const found = table(rows, "facts values");
        rows.forEach(([, , many], place) => found.rows[place].cells[1].classList.toggle("many", many === true));
        this.pointer.replaceChildren(found);
    }
}
