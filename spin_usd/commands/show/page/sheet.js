"use strict";
// A picture with what lies over it, in a place of its own on the page.

class Sheet extends EventTarget {
    /** gallery: of whose pictures one is shown: targets, parts and labels. */
    constructor(node, gallery, overlays) {
        super();
        Object.assign(this, { gallery, overlays, shown: null, labels: null, events: null, canvases: new Map() });
        this.stage = new Stage(node);
        this.stage.addEventListener("zoom", () => this.drawLines());
        overlays.addEventListener("change", () => this.draw());
    }

    /** Show nothing, so that the next picture does not begin with this one. */
    clear() {
        this.shown = this.labels = this.events = null;
        this.stage.paper.hidden = true;
    }

    /** Show the picture that a record file has, null for a damaged one, without its labels. */
    take(found) {
        this.shown = found;
        this.labels = this.events = null;
        if (found) this.takeImage(found);
        this.stage.paper.hidden = !found;
        this.draw();
    }

    takeImage({ record, files, lens_limit: limit }) {
        this.camera = new Camera(record.camera, limit);
        this.stage.resize(record.camera.width, record.camera.height);
        this.stage.setImage(files.image, `${record.frame} of ${record.variant}`);
    }

    /** Return a promise of the labels of the picture that is shown, null where it has none. */
    async labelsOf(found) {
        if (!found?.files.labels) return null;
        const { camera, gallery } = this;
        return new Labels(await loadData(found.files.labels), found.record, camera, gallery.parts);
    }

    takeLabels(labels) {
        this.labels = labels;
        this.draw();
    }

    /** Return a promise of the events that follow the picture that is shown, null where it has none. */
    async eventsOf(found) {
        return found?.files.events ? loadData(found.files.events) : null;
    }

    takeEvents(events) {
        this.events = events;
        this.draw();
    }

    draw() {
        this.stage.areas.replaceChildren();
        this.stage.scales.replaceChildren();
        for (const overlay of this.overlays.all) {
            const there = overlay.area && this.labels?.has(overlay.name) && this.labels.pixels > 0;
            const events = overlay.name === EVENTS.name && this.events;
            if (!overlay.on || !(there || events)) continue;
            const canvas = events ? this.paintedEvents(overlay) : this.painted(overlay);
            canvas.style.opacity = overlay.blend;
            this.stage.areas.append(canvas);
            if (overlay.colours === "by_distance")
                this.stage.scales.append(scaleOf(overlay.title, this.labels.planes(overlay.name)));
        }
        this.drawLines();
    }

    /** Return the canvas of an area, painted once for the same labels. */
    painted(overlay) {
        const { labels } = this;
        if (this.canvases.get(overlay)?.of !== labels) {
            const canvas = painted(labels.planes(overlay.name), overlay.colours, labels.width, labels.height);
            canvas.style.left = `${labels.x0}px`;
            canvas.style.top = `${labels.y0}px`;
            canvas.dataset.kind = overlay.name;
            this.canvases.set(overlay, { of: labels, canvas });
        }
        return this.canvases.get(overlay).canvas;
    }

    /** Return the canvas of the events in the window that is chosen. */
    paintedEvents(overlay) {
        const { width, height } = this.events.header;
        const more = this.events.arrays.get("more").subarray(this.overlays.eventWindow * width * height);
        const canvas = painted([more], "by_sign", width, height);
        canvas.style.left = canvas.style.top = "0";
        canvas.dataset.kind = overlay.name;
        return canvas;
    }

    drawLines() {
        const { drawing } = this.stage;
        drawing.replaceChildren();
        for (const overlay of this.shown ? this.overlays.all : []) {
            if (overlay.area || !overlay.on) continue;
            for (const target of this.shown.record.targets) {
                const described = this.gallery.targets.find((each) => each.id === target.id);
                drawing.append(
                    shape(
                        "g",
                        { "data-drawn": overlay.name },
                        ...LINES[overlay.name](target, this.camera, 1 / this.stage.zoom, described),
                    ),
                );
            }
        }
    }
}
