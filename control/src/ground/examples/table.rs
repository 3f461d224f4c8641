//! The trained example table: scale, radius, k and examples, in millimetres and millimetres a second.
//!
//! Written by `weeder train --synthetic --seed 1 --max 64`. Do not edit it: train it again.

use crate::ground::class::label;
use crate::ground::features::COUNT as FEATURES;
use knn::Range;

/// The values of each feature that map onto 0 and 255.
pub const RANGES: [Range; FEATURES] = [
    Range { lowest: 70, highest: 902 },
    Range { lowest: -611, highest: 1940 },
    Range { lowest: 189, highest: 337 },
    Range { lowest: 24, highest: 371 },
    Range { lowest: 340, highest: 716 },
];

/// Squared distance beyond which no example is near enough.
pub const RADIUS: u32 = 172;

/// Examples that vote.
pub const K: u8 = 3;

/// Speed, spacing, delay, hold and actuation of each example, and its label.
pub const TRAINED: [([i16; FEATURES], u8); 64] = [
    ([278, 71, 300, 114, 453], label::WEED),
    ([278, 190, 300, 114, 453], label::WEED),
    ([278, 282, 300, 120, 459], label::WEED),
    ([278, 370, 300, 115, 454], label::WEED),
    ([278, 538, 300, 115, 454], label::WEED),
    ([278, 663, 300, 117, 456], label::WEED),
    ([278, 783, 300, 118, 457], label::WEED),
    ([278, 932, 300, 117, 456], label::WEED),
    ([278, 1021, 300, 118, 457], label::WEED),
    ([278, 1133, 300, 117, 456], label::WEED),
    ([417, 65, 275, 116, 450], label::WEED),
    ([417, 185, 275, 112, 446], label::WEED),
    ([417, 346, 275, 117, 451], label::WEED),
    ([417, 422, 275, 112, 446], label::WEED),
    ([417, 522, 275, 114, 448], label::WEED),
    ([417, 614, 275, 114, 448], label::WEED),
    ([417, 747, 275, 116, 450], label::WEED),
    ([417, 845, 275, 115, 449], label::WEED),
    ([417, 943, 275, 117, 451], label::WEED),
    ([417, 1087, 275, 115, 449], label::WEED),
    ([556, 107, 250, 117, 445], label::WEED),
    ([556, 283, 250, 116, 444], label::WEED),
    ([556, 450, 250, 116, 444], label::WEED),
    ([556, 628, 250, 115, 443], label::WEED),
    ([556, 715, 250, 112, 440], label::WEED),
    ([556, 862, 250, 112, 440], label::WEED),
    ([556, 1073, 250, 114, 442], label::WEED),
    ([694, 44, 226, 119, 442], label::WEED),
    ([694, 137, 226, 117, 440], label::WEED),
    ([694, 289, 226, 116, 439], label::WEED),
    ([694, 385, 226, 119, 442], label::WEED),
    ([694, 469, 226, 115, 438], label::WEED),
    ([694, 557, 226, 119, 442], label::WEED),
    ([694, 662, 226, 116, 439], label::WEED),
    ([694, 866, 226, 117, 440], label::WEED),
    ([694, 978, 226, 116, 439], label::WEED),
    ([694, 1160, 226, 112, 435], label::WEED),
    ([278, 445, 300, 249, 588], label::PLANT),
    ([278, 533, 300, 239, 578], label::PLANT),
    ([278, 547, 300, 265, 604], label::PLANT),
    ([278, 557, 300, 225, 564], label::PLANT),
    ([278, 561, 300, 278, 617], label::PLANT),
    ([278, 569, 300, 211, 550], label::PLANT),
    ([278, 633, 300, 254, 593], label::PLANT),
    ([278, 1013, 300, 264, 603], label::PLANT),
    ([417, 505, 275, 279, 613], label::PLANT),
    ([417, 535, 275, 206, 540], label::PLANT),
    ([417, 545, 275, 265, 599], label::PLANT),
    ([417, 561, 275, 245, 579], label::PLANT),
    ([417, 572, 275, 225, 559], label::PLANT),
    ([417, 1025, 275, 206, 540], label::PLANT),
    ([417, 1175, 275, 218, 552], label::PLANT),
    ([556, 515, 250, 278, 606], label::PLANT),
    ([556, 522, 250, 262, 590], label::PLANT),
    ([556, 540, 250, 220, 548], label::PLANT),
    ([556, 550, 250, 241, 569], label::PLANT),
    ([556, 579, 250, 205, 533], label::PLANT),
    ([556, 1072, 250, 216, 544], label::PLANT),
    ([694, 529, 226, 257, 580], label::PLANT),
    ([694, 550, 226, 277, 600], label::PLANT),
    ([694, 552, 226, 228, 551], label::PLANT),
    ([694, 571, 226, 209, 532], label::PLANT),
    ([694, 578, 226, 245, 568], label::PLANT),
    ([694, 1188, 226, 213, 536], label::PLANT),
];
