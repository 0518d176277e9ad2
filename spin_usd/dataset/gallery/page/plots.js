"use strict";
// Distributions over the selected pictures, beside those of another dataset.

class Distributions {
  constructor(gallery, selection, node) {
    Object.assign(this, { gallery, selection, node });
  }
  draw() {}
}
