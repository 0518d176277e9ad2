"use strict";
// Starts the page: the part of the address after "#" says what it shows.

const MORE = "\0more"; // no value of a record is called so

class Page {
    constructor(gallery) {
        this.gallery = gallery;
        this.row = undefined; // of the picture that was chosen last
        this.asked = 0; // how many addresses were shown
        this.text = ""; // of the selection, as the address has it
        this.tags = new Tags(gallery);
        this.selection = new Selection(gallery, this.tags);
        this.grid = new Grid(gallery, this.selection, this.tags, byId("grid"), byId("tiles"), byId("empty"));
        this.filters = new Filters(gallery, this.selection, byId("filters"));
        this.filters.name.after(new TagPanel(this.tags, this.selection, this.grid).node);
        this.picture = new PictureView(gallery, this.selection, this.tags, byId("stage"), byId("side"));
        this.filters.addEventListener("fault", ({ detail }) => this.say(detail));
        this.tags.addEventListener("fault", ({ detail }) => this.sayText(`${detail.message}.`));
        this.tags.addEventListener("change", () => this.sayText(""));
        this.distributions = new Distributions(gallery, this.selection, byId("distributions"));
        byId("dataset").textContent = document.title = gallery.dataset;
        fillKeys(byId("keys"), this.picture.overlays, gallery.beside);
        this.fillSorting();
        this.listen();
        this.count();
        this.route().then(() => {
            document.body.dataset.ready = "";
        });
    }

    fillSorting() {
        const option = (value, text) => element("option", { value }, text);
        const measures = this.gallery.measures
            .filter(({ name }) => this.gallery.varies(name))
            .map(({ name }) => option(name, this.gallery.title(name)));
        const usual = [...this.gallery.files.keys()].filter((name) => !isSeldom(name));
        const others = usual.map((name) => option(name, name));
        byId("sort").append(
            option("", "as in the dataset"),
            element("optgroup", { label: "Measures" }, ...measures),
            element("optgroup", { label: "Values of the records" }, ...others),
        );
        byId("sort").addEventListener("change", async (event) => {
            const name = event.target.value;
            if (name === MORE) return this.unfoldSorting();
            const column = name ? await this.gallery.column(name).catch((fault) => this.say(fault)) : null;
            if (column === undefined || event.target.value !== name) return; // it failed, or another was chosen
            this.say(null);
            this.selection.sortedBy = name;
            this.selection.sorting = column && inOrder(column);
            this.selection.update();
        });
        const seldom = [...this.gallery.files.keys()].filter(isSeldom).length;
        if (seldom) byId("sort").append(element("option", { value: MORE }, `${seldom} more…`));
        byId("direction").addEventListener("click", () => {
            this.selection.descending = !this.selection.descending;
            this.selection.update();
        });
        byId("size").addEventListener("input", (event) => this.grid.setWidth(Number(event.target.value)));
        byId("crop").addEventListener("change", (event) => this.grid.setCrop(event.target.checked));
    }

    /** List the values that few sort by too, and open the list again. */
    unfoldSorting() {
        const sort = byId("sort");
        const more = [...sort.options].find(({ value }) => value === MORE);
        const seldom = [...this.gallery.files.keys()].filter(isSeldom);
        const options = seldom.map((name) => element("option", { value: name }, name));
        more?.replaceWith(element("optgroup", { label: "More values" }, ...options));
        sort.value = this.selection.sortedBy;
        if (navigator.userActivation?.isActive) sort.showPicker?.();
    }

    listen() {
        this.selection.addEventListener("change", () => this.changed());
        this.grid.addEventListener("open", ({ detail }) => this.go("picture", detail));
        this.grid.addEventListener("move", () => this.moved());
        this.picture.addEventListener("go", ({ detail }) => this.go("picture", detail, { anew: false }));
        this.picture.addEventListener("close", () => this.close());
        byId("theme").addEventListener("click", () => this.switchTheme());
        byId("help").addEventListener("click", () => byId("keys").showModal());
        addEventListener("hashchange", () => this.route());
        addEventListener("keydown", (event) => this.key(event));
    }

    /** Say what went wrong, beside the number of pictures; null takes it away. */
    say(fault) {
        this.sayText(fault ? `${fault.message}. Run spin-usd show again.` : "");
    }

    sayText(text) {
        byId("trouble").textContent = text;
    }

    changed() {
        const { selection } = this;
        this.count();
        if (isSeldom(selection.sortedBy)) this.unfoldSorting();
        byId("sort").value = selection.sortedBy;
        byId("direction").textContent = selection.descending ? "↓" : "↑";
        byId("direction").setAttribute("aria-pressed", selection.descending);
        if (this.taking) return; // the address says so already
        const typing = this.text && selection.text && this.text !== selection.text; // one step back, not one a letter
        this.text = selection.text;
        this.go(this.view, this.row, { anew: !typing });
    }

    count() {
        const { count } = this.gallery;
        const shownCount = this.selection.rows.length;
        byId("count").textContent = shownCount === count ? `${count} pictures` : `${shownCount} of ${count} pictures`;
    }

    /** Go to that view, of the picture of that row. anew: whether the browser's back button leads back here. */
    go(view, row, { anew = true } = {}) {
        clearTimeout(this.later);
        const address = `#${this.address(view, row)}`;
        if (address === (location.hash || "#pictures")) return;
        if (anew) location.hash = address;
        else location.replace(address);
    }

    address(view, row) {
        const { gallery, selection } = this;
        const named = row !== undefined && view !== "distributions";
        return addressOf(view, named ? [gallery.variant(row), gallery.frame(row)] : [], queryOf(selection));
    }

    /** Another tile has the focus: the address says so once the arrows rest, for browsers refuse to change it often. */
    moved() {
        this.row = this.grid.row;
        clearTimeout(this.later);
        this.later = setTimeout(() => this.go("pictures", this.row, { anew: false }), 300);
    }

    close() {
        this.go("pictures", this.row);
    }

    /** Show what the address says. */
    async route() {
        clearTimeout(this.later);
        const { view, names, query } = addressed();
        this.asked += 1;
        const asked = this.asked;
        if (query !== queryOf(this.selection)) {
            const state = await readQuery(query, this.gallery, this.tags).catch((fault) => this.say(fault));
            if (asked !== this.asked) return; // another address came meanwhile
            if (state) this.take(state);
        }
        const row = this.gallery.rowOf(names[1], names[0]);
        this.show(view === "picture" && row === undefined ? "pictures" : view, row);
    }

    take(state) {
        this.taking = true;
        this.selection.take(state);
        this.taking = false;
        this.text = this.selection.text;
    }

    show(shown, row) {
        this.row = row ?? this.row;
        for (const id of ["pictures", "distributions", "picture"]) byId(id).hidden = id !== shown;
        byId("sorting").hidden = shown !== "pictures";
        byId("to-pictures").setAttribute("aria-current", shown === "distributions" ? "false" : "page");
        byId("to-distributions").setAttribute("aria-current", shown === "distributions" ? "page" : "false");
        const before = this.view;
        this.view = shown;
        this.link();
        if (shown === "picture") this.openPicture(row);
        else this.picture.clear();
        if (shown === "distributions") this.distributions.draw();
        if (shown === "pictures" && shown !== before) this.showGrid(); // else the focus is where the user put it
    }

    /** Let the links to the views keep what is chosen. */
    link() {
        for (const view of ["pictures", "distributions"]) byId(`to-${view}`).href = `#${this.address(view, this.row)}`;
    }

    openPicture(row) {
        this.picture.open(row);
        if (!byId("picture").contains(document.activeElement)) byId("stage").focus();
    }

    showGrid() {
        const place = this.selection.rows.indexOf(this.row);
        this.grid.draw();
        if (place >= 0) this.grid.focus(place);
    }

    switchTheme() {
        const dark = getComputedStyle(document.documentElement).colorScheme === "dark";
        document.documentElement.dataset.theme = dark ? "light" : "dark";
        if (this.view === "distributions") this.distributions.draw();
    }

    key(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || byId("keys").open) return;
        if (event.key === "Escape" && this.view !== "pictures") this.close();
        else if (event.key === "Escape" && this.grid.pen !== null) this.grid.setPen(null);
        else if (isTyping(event) || !this.act(event)) return;
        event.preventDefault();
    }

    /** Do what the key says; return whether it says anything. */
    act({ key, target }) {
        const acts = {
            "?": () => byId("help").click(),
            x: () => this.switchTheme(),
            s: () => this.go("distributions"),
            g: () => this.close(),
        };
        if (acts[key]) acts[key]();
        else if (/^[1-9]$/.test(key) && this.view !== "distributions") return this.tag(Number(key) - 1);
        else if (this.view === "picture") return this.actOnPicture(key);
        else if (this.view === "pictures") return this.actOnGrid(key, target);
        else return false;
        return true;
    }

    /** Give the picture the tag at that place, or take it away. */
    tag(place) {
        const name = this.tags.names[place];
        const row = this.view === "picture" ? this.picture.row : this.grid.row;
        if (name === undefined || row === undefined) return false;
        this.tags.toggle(name, row);
        return true;
    }

    actOnGrid(key, target) {
        if (key === "/") this.filters.name.focus();
        else if (key === "t") byId("crop").click();
        else if (byId("filters").contains(target)) return false;
        else return this.grid.key(key);
        return true;
    }

    actOnPicture(key) {
        const { picture } = this;
        const acts = {
            ArrowLeft: () => picture.step(-1),
            ArrowRight: () => picture.step(1),
            ArrowUp: () => picture.stepVariant(-1),
            ArrowDown: () => picture.stepVariant(1),
            "+": () => picture.stage.zoomBy(1.5),
            "-": () => picture.stage.zoomBy(1 / 1.5),
            f: () => picture.stage.fit(),
            z: () => picture.zoomToTargets(),
            0: () => picture.overlays.clear(),
            i: () => picture.stage.image.classList.toggle("hidden"),
        };
        if (!acts[key]) return picture.comparison?.key(key) || picture.overlays.key(key);
        acts[key]();
        return true;
    }
}

loadData("index.js").then(
    (found) => new Page(new Gallery(found)),
    (fault) => {
        byId("dataset").textContent = `This page cannot be shown: ${fault.message}. Run spin-usd show again.`;
    },
);
