"use strict";
// What can be laid over a picture: labels as areas, each with a blend, and drawings of lines.

const AREA_KEYS = {
    depth: "d",
    segmentation: "p",
    dense_pose: "o",
    normals_cam: "n",
    normals_body: "m",
    instance: "t",
    lit: "l",
};
const AREA_TITLES = {
    segmentation: "Parts",
    dense_pose: "Dense pose",
    normals_cam: "Normals (camera)",
    normals_body: "Normals (body)",
    lit: "Sunlight",
};
const EVENT_WINDOWS = 8;
const EVENTS = {
    name: "events",
    title: "Events",
    key: "v",
    meaning: "Red where it became brighter, blue where darker, in 1/30 s from the picture on",
    area: true,
};
const DRAWN = [
    { name: "boxes", title: "Boxes", key: "b" },
    { name: "cuboid", title: "3D box", key: "c" },
    { name: "keypoints", title: "Keypoints", key: "k" },
    { name: "axes", title: "Pose axes", key: "a" },
];

/** Return what people call the label. */
function overlayTitle(kind) {
    return AREA_TITLES[kind] ?? kind[0].toUpperCase() + kind.slice(1).replaceAll("_", " ");
}

class Overlays extends EventTarget {
    constructor(gallery) {
        super();
        this.gallery = gallery;
        const areas = gallery.labels.map(({ kind, colours, meaning }) => {
            return {
                name: kind,
                title: overlayTitle(kind),
                key: AREA_KEYS[kind],
                colours,
                meaning,
                area: true,
                on: false,
                blend: 0.6,
            };
        });
        this.eventWindow = 0; // of the events, counted from the picture's time
        const events = gallery.events ? [{ ...EVENTS, on: false, blend: 0.8 }] : [];
        this.all = [...areas, ...events, ...DRAWN.map((drawn) => ({ ...drawn, on: false }))];
        this.blends = element("div", { className: "blends" });
        this.controls = element(
            "div",
            {},
            element("div", { className: "overlays" }, ...this.all.map((overlay) => this.control(overlay))),
            this.blends,
        );
    }

    control(overlay) {
        const box = element("input", { type: "checkbox" });
        box.addEventListener("change", () => this.set(overlay, box.checked));
        overlay.box = box;
        const key = overlay.key ? element("kbd", {}, overlay.key) : "";
        if (overlay.area) this.blends.append(this.blend(overlay));
        return element("label", { className: "check", title: overlay.meaning ?? "" }, box, ` ${overlay.title} `, key);
    }

    /** Return the means to blend an area with the image, which are there while it is shown. */
    blend(overlay) {
        const blend = element("input", {
            type: "range",
            min: 0,
            max: 1,
            step: 0.05,
            value: overlay.blend,
            "aria-label": `Blend of ${overlay.title}`,
        });
        blend.addEventListener("input", () => {
            overlay.blend = Number(blend.value);
            this.set(overlay, true);
        });
        overlay.blending = element("label", { hidden: true }, `Blend of ${overlay.title.toLowerCase()} `, blend);
        if (overlay.name === EVENTS.name) overlay.blending.append(this.eventTime(overlay));
        return overlay.blending;
    }

    /** Return the means to choose which events are shown, by how long after the picture they are. */
    eventTime(overlay) {
        const slider = element("input", {
            type: "range",
            min: 0,
            max: EVENT_WINDOWS - 1,
            step: 1,
            value: 0,
            "aria-label": "Time of events",
        });
        slider.addEventListener("input", () => {
            this.eventWindow = Number(slider.value);
            this.set(overlay, true);
        });
        return element("span", {}, "Time of events ", slider);
    }

    set(overlay, on) {
        overlay.on = overlay.box.checked = on;
        if (overlay.area) overlay.blending.hidden = !on;
        this.dispatchEvent(new Event("change"));
    }

    /** Answer a letter; return whether an overlay has it. */
    key(key) {
        const overlay = this.all.find((each) => each.key === key);
        if (overlay) this.set(overlay, !overlay.on);
        return overlay !== undefined;
    }

    /** Show the first label that there is where none is shown: for a picture without an image. */
    showOne(labels) {
        const there = this.all.filter((overlay) => overlay.area && labels.has(overlay.name));
        if (there.length && !there.some(({ on }) => on)) this.set(there[0], true);
    }

    clear() {
        for (const overlay of this.all) this.set(overlay, false);
    }
}
