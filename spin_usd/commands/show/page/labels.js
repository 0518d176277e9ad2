"use strict";
// The labels of one picture: numbers by pixel of the full frame, those of the dataset's files to the last bit;
// the dense pose alone is rounded.

class Labels {
    /** data: what loadData gives of the file · parts: of the dataset, [name, class, target, materials] by id. */
    constructor({ header, arrays }, record, camera, parts) {
        [this.x0, this.y0, this.x1, this.y1] = header.box;
        this.width = this.x1 - this.x0;
        this.height = this.y1 - this.y0;
        this.pixels = this.width * this.height;
        this.described = header.labels;
        Object.assign(this, { arrays, record, camera, parts, decoded: new Map() });
    }

    has(kind) {
        return kind in this.described;
    }

    /** Return the planes of that label, one for each channel, a number for each pixel of the box. */
    planes(kind) {
        if (!this.decoded.has(kind)) this.decoded.set(kind, this.decode(kind));
        return this.decoded.get(kind);
    }

    decode(kind) {
        const { dtype, channels, step_from_depth: step } = this.described[kind];
        const numbers = unpackedNumbers(this.arrays.get(kind), dtype, channels, this.height, this.width);
        const planes = Array.from({ length: channels }, (_, channel) =>
            numbers.subarray(channel * this.pixels, (channel + 1) * this.pixels),
        );
        return step === undefined ? planes : this.points(planes, step);
    }

    /** Return the place of a pixel in the planes; -1 outside the box. */
    index(column, row) {
        if (column < this.x0 || column >= this.x1 || row < this.y0 || row >= this.y1) return -1;
        return (row - this.y0) * this.width + column - this.x0;
    }

    /** Return the label's numbers at the pixel, one for each channel; null where it is 0. */
    at(kind, column, row) {
        const index = this.index(column, row);
        if (index < 0) return null;
        const values = this.planes(kind).map((plane) => plane[index]);
        return values.some((value) => value !== 0) ? values : null;
    }

    /** Return the points of the dense pose: those of the depth, and the steps by which the file differs from them. */
    points(steps, step) {
        const found = steps.map(() => new Float64Array(this.pixels));
        const [depth] = this.planes("depth");
        const poses = new Map(this.record.targets.map((target) => [target.id, target.pose]));
        const targetOf = this.targets();
        for (let row = 0, i = 0; row < this.height; row += 1) {
            let ray = null; // that of the pixel before is a good start
            for (let column = 0; column < this.width; column += 1, i += 1) {
                let point = [0, 0, 0];
                const pose = depth[i] > 0 && poses.get(targetOf(i));
                if (pose) {
                    ray = this.camera.ray(this.x0 + column + 0.5, this.y0 + row + 0.5, ray);
                    point = ray ? toBody(pose, [ray[0] * depth[i], ray[1] * depth[i], depth[i]]) : [NaN, NaN, NaN];
                }
                for (let axis = 0; axis < 3; axis += 1) found[axis][i] = point[axis] + steps[axis][i] * step;
            }
        }
        return found;
    }

    /** Return a function that gives the id of the target in a pixel, by the instance, or else by the part. */
    targets() {
        if (this.has("instance")) {
            const [instance] = this.planes("instance");
            return (i) => instance[i];
        }
        const [segmentation] = this.planes("segmentation");
        return (i) => this.parts[segmentation[i]]?.[2] ?? 0;
    }
}

/** Undo what `packed` in label_file.py did: put the bytes together, and add up along rows and columns. */
function unpackedNumbers(bytes, dtype, channels, height, width) {
    const count = channels * height * width;
    const numbers = new ARRAY_TYPES[dtype](count);
    const bits = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[numbers.BYTES_PER_ELEMENT];
    const whole = new bits(numbers.buffer);
    for (let byte = 0; byte < whole.BYTES_PER_ELEMENT; byte += 1) {
        const plane = bytes.subarray(byte * count, (byte + 1) * count);
        for (let i = 0; i < count; i += 1) whole[i] |= plane[i] << (8 * byte);
    }
    if (whole.BYTES_PER_ELEMENT === 4) addUp(whole, channels, height, width);
    return numbers;
}

function addUp(whole, channels, height, width) {
    for (let channel = 0, i = 0; channel < channels; channel += 1) {
        for (let row = 0; row < height; row += 1) {
            let sum = 0; // of this row
            for (let column = 0; column < width; column += 1, i += 1) {
                sum = (sum + ((whole[i] >>> 1) ^ -(whole[i] & 1))) | 0;
                whole[i] = sum + (row ? whole[i - width] : 0);
            }
        }
    }
}
