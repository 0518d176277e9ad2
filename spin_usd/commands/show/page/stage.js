"use strict";
// Where one picture is shown.

/** The picture with what lies over it, which zooms and moves as one. */
class Stage extends EventTarget {
    constructor(node) {
        super();
        this.node = node;
        this.image = element("img", { alt: "" });
        this.areas = element("div", { className: "areas" });
        this.drawing = shape("svg", { class: "drawing" });
        this.paper = element("div", { className: "paper" }, this.image, this.areas, this.drawing);
        this.fault = element("p", { className: "fault", role: "alert", hidden: true });
        this.scales = element("div", { className: "scales" });
        node.append(this.paper, this.scales, this.fault);
        this.zoom = 1;
        this.x = this.y = 0;
        node.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
        node.addEventListener("pointerdown", (event) => this.drag(event));
        new ResizeObserver(() => this.fit()).observe(node);
    }

    /** Take a picture of that size in pixels, and show all of it. */
    resize(width, height) {
        const same = this.width === width && this.height === height;
        Object.assign(this, { width, height });
        this.paper.style.width = `${width}px`;
        this.paper.style.height = `${height}px`;
        this.drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
        if (!same) this.fit();
    }

    /** Return a promise that is kept when the browser can show the image at once, or never can. */
    async preload(source) {
        if (!source) return;
        const image = element("img", { src: source });
        await image.decode().catch(() => {}); // a damaged image shows its alternative text
    }

    /** Show that image, none where the source is undefined. */
    setImage(source, alt) {
        if (source) this.image.src = source;
        else this.image.removeAttribute("src");
        this.image.alt = alt;
    }

    fit() {
        if (!this.width || !this.node.clientWidth) return;
        this.zoom = Math.min(this.node.clientWidth / this.width, this.node.clientHeight / this.height);
        this.x = (this.node.clientWidth - this.width * this.zoom) / 2;
        this.y = (this.node.clientHeight - this.height * this.zoom) / 2;
        this.place();
    }

    /** Show this box, x0, y0, x1, y1 in pixels, with some room around it. */
    show([x0, y0, x1, y1]) {
        const wide = Math.max(x1 - x0, 8) * 1.25,
            tall = Math.max(y1 - y0, 8) * 1.25;
        this.zoom = Math.min(this.node.clientWidth / wide, this.node.clientHeight / tall, 64);
        this.x = this.node.clientWidth / 2 - ((x0 + x1) / 2) * this.zoom;
        this.y = this.node.clientHeight / 2 - ((y0 + y1) / 2) * this.zoom;
        this.place();
    }

    /** Show the same part of the frame as another stage does, whatever the pixels of both are. */
    follow({ zoom, x, y, width }) {
        if (!this.width || !width) return;
        const own = (zoom * width) / this.width;
        const near = Math.abs(own - this.zoom) < 1e-9 * own && x === this.x && y === this.y;
        if (near) return; // so that two may follow each other
        Object.assign(this, { zoom: own, x, y });
        this.place();
    }

    place() {
        this.paper.style.transform = `translate(${this.x}px, ${this.y}px) scale(${this.zoom})`;
        this.paper.style.setProperty("--unit", `${1 / this.zoom}px`); // a pixel of the screen
        this.paper.classList.toggle("close", this.zoom >= 2);
        this.dispatchEvent(new Event("zoom"));
    }

    /** Zoom by a factor around a place of the window; around the middle where none is given. */
    zoomBy(factor, clientX, clientY) {
        const box = this.node.getBoundingClientRect();
        const x = (clientX ?? box.left + box.width / 2) - box.left;
        const y = (clientY ?? box.top + box.height / 2) - box.top;
        const zoom = Math.min(Math.max(this.zoom * factor, 0.05), 64);
        this.x = x - ((x - this.x) * zoom) / this.zoom;
        this.y = y - ((y - this.y) * zoom) / this.zoom;
        this.zoom = zoom;
        this.place();
    }

    wheel(event) {
        event.preventDefault();
        this.zoomBy(Math.exp(-event.deltaY / 400), event.clientX, event.clientY);
    }

    drag(event) {
        const from = [event.clientX - this.x, event.clientY - this.y];
        this.node.setPointerCapture(event.pointerId);
        this.node.onpointermove = (moved) => {
            [this.x, this.y] = [moved.clientX - from[0], moved.clientY - from[1]];
            this.place();
        };
        this.node.onpointerup = () => {
            this.node.onpointermove = this.node.onpointerup = null;
        };
    }

    /** Return [u, v], where in the picture the pointer is, in its pixels; null outside. */
    position(event) {
        const box = this.node.getBoundingClientRect();
        const u = (event.clientX - box.left - this.x) / this.zoom;
        const v = (event.clientY - box.top - this.y) / this.zoom;
        return u >= 0 && v >= 0 && u < this.width && v < this.height ? [u, v] : null;
    }
}
