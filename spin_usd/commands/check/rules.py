"""All rules of `spin-usd check`, by the code of their findings: meaning and remedy.

A finding's own message gives its place and exact fault. Findings with other codes come from OpenUSD's own validators.
"""

from dataclasses import dataclass

_AGAIN = "Run `check --repair`, or `render` with the same stage and options."
_SENSE = "None if intended; else change pose, camera or light."


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Meaning of a finding, and its remedy."""

    meaning: str
    """Meaning of a finding of this rule, one sentence."""
    remedy: str = _AGAIN
    """Action that removes the finding."""


STAGE = {
    "refused": Rule(meaning="The stage contains something forbidden, and is not opened.", remedy="Follow the message."),
    "unreadable": Rule(
        meaning="A value or a file cannot be read.", remedy="Correct it; a file of a dataset by `check --repair`."
    ),
    "scene": Rule(meaning="A picture cannot be rendered: its scene is refused.", remedy="Follow the message."),
    "layer-metadata": Rule(
        meaning="A layer lacks its up axis, units or default prim; where it is root, USD falls back to its own.",
        remedy="Author the intended value in that layer.",
    ),
    "layer-units": Rule(
        meaning="A layer has another up axis or unit than the root layer, which USD does not convert.",
        remedy="Make them equal, or scale and rotate where the layer is referenced.",
    ),
    "layer-time": Rule(
        meaning="A layer counts its time codes at another rate, so its samples are moved off the pictures.",
        remedy="Make timeCodesPerSecond equal.",
    ),
    "path-not-anchored": Rule(
        meaning="An asset path does not begin with ./, so USD looks for it elsewhere too.", remedy="Write ./ before it."
    ),
    "capture-range": Rule(
        meaning="The stage starts and ends at other times than its pictures.",
        remedy="Make startTimeCode and endTimeCode equal to theirs.",
    ),
    "pose-matrix": Rule(
        meaning="A pose is sampled as matrices, which shear between time samples.",
        remedy="Author translate and orient.",
    ),
    "pose-precision": Rule(
        meaning="A pose's type rounds it by more than pictures could show.",
        remedy="Author double3 translate and quatd orient.",
    ),
    "pose-norm": Rule(
        meaning="The quaternion of a target or camera is not of length 1, so USD reads another rotation.",
        remedy="Normalise it.",
    ),
    "pose-blended": Rule(
        meaning="Pictures lie between time samples, so their poses are blends.", remedy="Author a sample at each frame."
    ),
    "orient-rounded": Rule(meaning="A quaternion is off length 1, and was normalised.", remedy="Normalise it."),
    "lens": Rule(meaning="A camera's lens cannot be used.", remedy="Follow the message."),
    "lens-aside": Rule(
        meaning="The principal point is outside the picture.", remedy="Check the camera's size in pixels."
    ),
    "lens-derived": Rule(
        meaning="USD's own camera attributes do not match the lens, so other programs show another view.",
        remedy="Set them to the values in the message, or let `author` write the camera.",
    ),
    "lens-none": Rule(
        meaning="A camera has numbers of a lens without SpinLensAPI, or no size in pixels.", remedy="Apply SpinLensAPI."
    ),
    "kind-broken": Rule(
        meaning="A model has an ancestor that is not a group, so USD does not see it as a model.",
        remedy="Make every ancestor a group or an assembly.",
    ),
    "label-none": Rule(
        meaning="A surface of the target has no class.", remedy="Author a class label on it, or on a prim above it."
    ),
    "light": Rule(
        meaning="A light lacks an attribute that decides its power, or is far darker than the Sun.",
        remedy="Author the intended value.",
    ),
    "light-unit": Rule(
        meaning="Lights of one stage are in different units: one has lux or nits, or no unit beside others in watts.",
        remedy="Convert it, and state its unit in its customData.",
    ),
    "extent-none": Rule(
        meaning="Geometry has no extent, so viewers must read all its points to frame it.", remedy="Author its extent."
    ),
    "draw-mode": Rule(
        meaning="A model's draw mode is cards or bounds; pictures show its geometry.",
        remedy="Remove its draw mode.",
    ),
    "property-unknown": Rule(
        meaning="A property has a name of ours that no schema has: it does nothing.", remedy="Correct its name."
    ),
    "xform-unread": Rule(
        meaning="A transform operation is not in its prim's order: it moves nothing, whatever its value.",
        remedy="Put it into xformOpOrder, or remove it.",
    ),
    "variant-broken": Rule(meaning="A variant does not compose.", remedy="Follow the message."),
    "variant-dead": Rule(
        meaning="An opinion of a variant has no effect: a local one beats it, or its prim is not there.",
        remedy="Bring the local one by reference, or remove that opinion.",
    ),
    "variant-unknown": Rule(
        meaning="A variant is selected that is not there; USD ignores that.", remedy="Select one that is."
    ),
    "variant-overlap": Rule(
        meaning="Two variants author the same thing; where both are selected, one wins.",
        remedy="Keep it in one of them.",
    ),
    "variant-same": Rule(
        meaning="An augmentation changes no picture.", remedy="Remove it, or let it change something."
    ),
    "variant-many": Rule(
        meaning="There are more variants than are looked at.", remedy="Check the others in a stage of their own."
    ),
    "color-clamped": Rule(meaning="A colour is above 1, and is rendered as 1.", remedy="Author colours up to 1."),
    "image-missing": Rule(meaning="A texture is not there; its fallback is rendered.", remedy="Add the file."),
    "texture-srgb": Rule(
        meaning="An image of numbers, such as roughness, is decoded as if they were colours.",
        remedy='Author inputs:sourceColorSpace = "raw" if they are linear.',
    ),
    "material-foreign": Rule(
        meaning="A material is for another renderer; the display colour is rendered.",
        remedy="Author a UsdPreviewSurface.",
    ),
    "material-missing": Rule(
        meaning="A prim is bound to a prim that is not a material; its display colour is rendered.",
        remedy="Bind a material that exists within the referenced scope.",
    ),
    "connection-lost": Rule(
        meaning="A shader input is connected to a source without value; its own or the fallback is rendered.",
        remedy="Connect it, or remove the connection.",
    ),
    "visibility-unknown": Rule(
        meaning="A visibility is neither inherited nor invisible; USD takes it for inherited.",
        remedy="Author inherited or invisible.",
    ),
    "geometry-thin": Rule(
        meaning="Curves and points have no surface, and are left out of labels and pictures.",
        remedy="Convert them to a Mesh where they should be seen.",
    ),
    "crease-sharp": Rule(
        meaning="A crease or a corner is sharper than 4 and not infinitely so; it is rendered as sharp.",
        remedy="Author a sharpness of 10, or up to 4.",
    ),
    "material-transparent": Rule(
        meaning="A material has opacity 0; its surfaces are left out of labels and pictures.",
        remedy="Remove its surfaces, or set spin:target:keepTransparent on the target.",
    ),
    "mesh-empty": Rule(meaning="A mesh has no faces.", remedy="Remove it, or give it faces."),
    "faces-crossing": Rule(
        meaning="Polygons cross themselves; each is shown as a fan of triangles.",
        remedy="Split them into simple polygons.",
    ),
    "normals-turned": Rule(
        meaning="Normals point to the back of their faces; they are turned, since path tracers show black there.",
        remedy="Recalculate the normals, or turn the faces.",
    ),
    "primvar-left-out": Rule(
        meaning="A primvar that a material reads has another type or count than it needs; it is left out.",
        remedy="Author it as the material reads it, with a value for each element.",
    ),
    "faces-coincident": Rule(
        meaning="Visible faces coincide: labels show the first, and light is lost.",
        remedy="Remove one of each two, or move it.",
    ),
    "target-size": Rule(meaning="The target is of a size that no spacecraft has.", remedy="Check its unit."),
    "camera-inside": Rule(
        meaning="The camera is inside the target's bounding box.",
        remedy="Check the units of the model and of the poses.",
    ),
    "target-behind": Rule(meaning="The target is behind the camera.", remedy="Place it at a z above zero."),
    "target-outside": Rule(
        meaning="The target is outside the frame.", remedy="Bring it nearer to the middle, or take a wider lens."
    ),
    "target-cut-off": Rule(
        meaning="The frame cuts the target off.", remedy="To see all of it, move it to the middle, or away."
    ),
    "target-small": Rule(meaning="The target is only a few pixels across.", remedy=_SENSE),
    "target-unlit": Rule(meaning="The side of the target that the camera sees faces away from the Sun.", remedy=_SENSE),
    "target-dark": Rule(meaning="A planet's shadow, or the lack of any light, leaves the target dark.", remedy=_SENSE),
}
"""Rules on stages."""

DATASET = {
    "description": Rule(meaning="dataset.json cannot be used."),
    "empty": Rule(meaning="The dataset holds no picture.", remedy="Run `render`."),
    "stage": Rule(
        meaning="The dataset's own stage, or its root layer, is missing or cannot be read.",
        remedy="Run `render` again with the stage that made the pictures.",
    ),
    "sums": Rule(meaning="stage/SHA256SUMS does not match the files of stage/."),
    "layer": Rule(
        meaning="A layer or image of the stage is not as it was when pictures were made.",
        remedy="Run `render` again with the stage that made the pictures.",
    ),
    "missing": Rule(meaning="A file that a record lists is not there."),
    "sha256": Rule(meaning="A file differs from its record."),
    "stray": Rule(meaning="A file of pictures or events is in no record.", remedy="Move it elsewhere, or remove it."),
    "link": Rule(meaning="A link is in the place of a file; links are not followed.", remedy="Put the file there."),
    "special": Rule(meaning="An entry is neither a file nor a folder, such as a pipe.", remedy="Remove it."),
    "outdated": Rule(
        meaning="A picture, or events, were made from another state of the stage.", remedy="Run `render` again."
    ),
    "cache": Rule(
        meaning="A file of the cache is damaged, strange, or of no use; it costs time, no picture.",
        remedy="`check --repair`, or remove it.",
    ),
    "shards": Rule(meaning="Shards are missing.", remedy="Make them, then `merge`; or `render`."),
    "record": Rule(meaning="A record cannot be used, or is not of its schema."),
    "numbers": Rule(meaning="A record or a file contains unusable numbers."),
    "size": Rule(meaning="A file has another size in pixels than the camera."),
    "depth": Rule(meaning="Depth is not the z of the dense pose."),
    "support": Rule(meaning="Labels cover different pixels."),
    "reprojection": Rule(meaning="The dense pose projects beside its own pixels."),
    "range": Rule(meaning="Range is not the length that depth gives."),
    "normals": Rule(meaning="Normals are not of length 1, face away, or disagree with pose or dense pose."),
    "classes": Rule(meaning="A pixel's class is not its part's."),
    "target-ids": Rule(
        meaning="A record's targets have other ids than in dataset.json.",
        remedy="`check --repair`, or `render` again: ids are the same in all variants now.",
    ),
    "instance": Rule(meaning="A pixel's target is not its part's."),
    "nocs": Rule(meaning="NOCS is not the dense pose as shares of the target's box."),
    "lit": Rule(meaning="Lit and normals disagree about surfaces turned away from the Sun."),
    "flow": Rule(meaning="Flow does not end at the dense pose's points in the next frame."),
    "disparity": Rule(meaning="Disparity does not end where the paired camera sees the dense pose's points."),
    "pose": Rule(meaning="The pose that OpenCV finds from the dense pose, or the range, is not the record's pose."),
    "box": Rule(meaning="A box does not agree with mask, pose and dense pose."),
    "pixels": Rule(meaning="Counts of pixels do not match the labels."),
    "keypoints": Rule(meaning="A keypoint is not at its recorded place, or is hidden but recorded as visible."),
    "cross": Rule(meaning="Cycles casts another label than the dataset has; only with `--cross`."),
    "nearly-black": Rule(meaning="Most of the target is black in the image.", remedy=_SENSE),
    "nearly-white": Rule(meaning="Most of the target is white in the image.", remedy=_SENSE),
    "exposure-end": Rule(meaning="Auto-exposure is at an end of its range.", remedy=_SENSE),
    "lidar": Rule(meaning="The record lacks the LiDAR, or its points disagree with depth."),
    "beams": Rule(meaning="Points lie beside their beams, or a beam is not the LiDAR's or is repeated."),
    "parts": Rule(meaning="A part of the LiDAR's points is not in dataset.json, or of another target there."),
    "noise": Rule(meaning="Ranges are further off than the LiDAR's noise explains."),
    "limits": Rule(meaning="Ranges are outside the LiDAR's limits."),
    "events": Rule(
        meaning="Events are out of order, too late, of unknown parts, or do not match their record.",
        remedy="Remove their record, and run `render` again with `--events`.",
    ),
    "event-rate": Rule(meaning="There are no events, or more than 1e9 a second.", remedy=_SENSE),
    "hot-pixels": Rule(
        meaning="Pixels have over 1,000 events a second, 50 times 99.9 % of pixels, and 10 times their neighbours.",
        remedy="None if intended; else raise thresholds or lower their spread.",
    ),
}
"""Rules on datasets."""

_LABELS = "Correct the labels, or leave these pictures out."
FOREIGN = {
    "files": Rule(meaning="Lists and files do not belong together.", remedy="Download the set again."),
    "camera": Rule(meaning="A camera cannot be used.", remedy="Correct it, or give `--camera`."),
    "camera-matrix": Rule(meaning="K does not fit the pictures.", remedy="Check which size of pictures K is of."),
    "pose-numbers": Rule(meaning="A pose has no usable numbers.", remedy=_LABELS),
    "quaternion-norm": Rule(meaning="A quaternion is not of length 1.", remedy="Normalise it."),
    "rotation-matrix": Rule(meaning="A matrix is not a rotation, or is left-handed.", remedy=_LABELS),
    "behind-camera": Rule(meaning="The target lies behind the camera.", remedy=_LABELS),
    "pose-reading": Rule(
        meaning="Poses agree with labels in the image only in another reading than the layout's.",
        remedy="`--repair-to FOLDER`.",
    ),
    "pose-image": Rule(
        meaning="A target is not where its pose puts it, by the body that all other pictures show.", remedy=_LABELS
    ),
    "keypoint-pose": Rule(meaning="Keypoints are not where the pose puts them.", remedy=_LABELS),
    "distance": Rule(meaning="A distance contradicts the target's size in the image.", remedy=_LABELS),
    "unit": Rule(meaning="Positions are in another unit than the layout's.", remedy="`--repair-to FOLDER`."),
    "depth-unit": Rule(meaning="Depth and positions are in different units.", remedy="Correct the scale of depth."),
    "depth-pose": Rule(meaning="Depth contradicts the pose.", remedy=_LABELS),
    "pose-late": Rule(meaning="Poses are of the picture before.", remedy="Shift the list by one picture."),
    "depth-ray": Rule(meaning="Depth is along rays instead of the axis.", remedy="Convert it, or state it."),
    "depth-mask": Rule(meaning="Depth and mask cover different pixels.", remedy=_LABELS),
    "mask-model": Rule(meaning="A mask is not the projection of the model.", remedy="Check pose, model and unit."),
    "mask-edge": Rule(meaning="Edges of masks lie beside the model's.", remedy="Check model, lens and half pixels."),
    "mask-empty": Rule(meaning="A mask is empty where there is a box.", remedy=_LABELS),
    "mask-pixels": Rule(meaning="A mask has another number of pixels than listed.", remedy=_LABELS),
    "mask-grey": Rule(meaning="A mask has values between black and white.", remedy="Threshold it."),
    "half-pixel": Rule(meaning="Labels are half a pixel off.", remedy="Check where the first pixel's centre is."),
    "shifted": Rule(meaning="Labels are shifted by the same pixels in all pictures.", remedy="Check K and labels."),
    "unannotated": Rule(meaning="Images have no labels.", remedy="None if intended, as negatives."),
    "mirrored": Rule(meaning="Labels or images are mirrored, or turned.", remedy="Mirror the labels, or the images."),
    "box-empty": Rule(meaning="A box has no area.", remedy=_LABELS),
    "box-outside": Rule(meaning="A box reaches out of the frame.", remedy=_LABELS),
    "box-mask": Rule(meaning="A box is not where the target's pixels are.", remedy=_LABELS),
    "box-order": Rule(meaning="The numbers of boxes are in another order.", remedy="Read them in the order named."),
    "visible-share": Rule(meaning="A visible share does not match its pixels.", remedy=_LABELS),
    "keypoint-flags": Rule(meaning="A keypoint's visibility is none of 0, 1 and 2.", remedy=_LABELS),
    "keypoint-outside": Rule(meaning="A visible keypoint lies outside the frame.", remedy=_LABELS),
    "image-lost": Rule(meaning="A listed image is not there.", remedy="Check names; download the set again."),
    "image-name": Rule(meaning="An image has another name or place than listed.", remedy="`--repair-to FOLDER`."),
    "image-size": Rule(meaning="An image has another size than its camera or list.", remedy="Scale K."),
    "label-size": Rule(meaning="A mask or depth has another size than its image.", remedy=_LABELS),
    "unlabelled": Rule(meaning="Images are in no list.", remedy="Label them, or remove them."),
    "listed-twice": Rule(meaning="An image is listed more than once.", remedy="Keep one entry."),
    "duplicate": Rule(meaning="Two images are the same, or look the same under different poses.", remedy=_LABELS),
    "split-overlap": Rule(meaning="Splits share images or poses.", remedy="Keep them in one split."),
    "class-unknown": Rule(meaning="A class is not in the list of classes.", remedy=_LABELS),
    "class-spelling": Rule(meaning="Classes differ in spelling alone.", remedy="Use one of them."),
    "equal-channels": Rule(meaning="All channels of an image are equal.", remedy="None if intended."),
    "encoded-twice": Rule(meaning="An image went through the sRGB curve twice.", remedy="Encode it once."),
    "time-order": Rule(meaning="Times are not in order.", remedy="Sort by time."),
}
"""Rules on data sets of others; "unreadable" is among the rules on stages."""

RULES = {**STAGE, **DATASET, **FOREIGN}
