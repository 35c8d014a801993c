/** Sources of the shaders. Pixels are device pixels relative to the centre of the viewport, y up. */

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

/** Uniforms of the view and the transform from the world to pixels. */
const VIEW = `
uniform vec2 u_center;    // centre of the view [m]
uniform vec4 u_matrix;    // rotation and scale, by columns [pixels per metre]
uniform vec2 u_size;      // size of the viewport [pixels]
vec2 toPixels(vec2 p) { return mat2(u_matrix.xy, u_matrix.zw) * (p - u_center); }
vec4 toClip(vec2 pixels) { return vec4(2.0 * pixels / u_size, 0.0, 1.0); }
`;

/** A line with round caps, drawn as a quad. */
const CAPSULE = `
out vec2 v_local;
flat out float v_length;
flat out float v_radius;
vec2 capsule(vec2 a, vec2 b, float width) {
  vec2 d = b - a;
  float len = length(d);
  vec2 along = len > 1e-5 ? d / len : vec2(1.0, 0.0);
  float end = float((gl_VertexID >> 1) & 1);
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  float r = 0.5 * width + 1.0;
  v_local = vec2(end * (len + 2.0 * r) - r, side * r);
  v_length = len;
  v_radius = 0.5 * width;
  return a + along * v_local.x + vec2(-along.y, along.x) * v_local.y;
}
`;

const CAPSULE_COVERAGE = `
in vec2 v_local;
flat in float v_length;
flat in float v_radius;
float coverage() {
  float x = v_local.x - clamp(v_local.x, 0.0, v_length);
  return clamp(v_radius - length(vec2(x, v_local.y)) + 0.5, 0.0, 1.0);
}
`;

/** Transform of a point of a body by the texture of poses; bodies without a pose are not drawn. */
const BODY = `
uniform sampler2D u_poses;
vec4 bodyPose(float slot) {
  int i = int(slot);
  return texelFetch(u_poses, ivec2(i & 255, i >> 8), 0);
}
vec2 ofBody(vec4 pose, vec2 p) {
  float c = cos(pose.z), s = sin(pose.z);
  return pose.xy + vec2(c * p.x - s * p.y, s * p.x + c * p.y);
}
`;

export const edgesVertex = `${HEAD}${VIEW}${CAPSULE}
in vec4 a_segment;
uniform float u_width;
void main() {
  gl_Position = toClip(capsule(toPixels(a_segment.xy), toPixels(a_segment.zw), u_width));
}`;

export const edgesFragment = `${HEAD}${CAPSULE_COVERAGE}
uniform vec4 u_color;
out vec4 color;
void main() { color = u_color * coverage(); }`;

export const flatVertex = `${HEAD}${VIEW}
in vec2 a_point;
void main() { gl_Position = toClip(toPixels(a_point)); }`;

export const flatFragment = `${HEAD}
uniform vec4 u_color;
out vec4 color;
void main() { color = u_color; }`;

export const coloredEdgesVertex = `${HEAD}${VIEW}${CAPSULE}
in vec4 a_segment;
in vec4 a_color;
in float a_width;
in float a_time;
uniform float u_time;       // [s]
uniform float u_lifetime;   // 0: lines do not fade
uniform float u_ratio;      // device pixels per CSS pixel
flat out vec4 v_color;
void main() {
  float fade = u_lifetime > 0.0 ? clamp(1.0 - (u_time - a_time) / u_lifetime, 0.0, 1.0) : 1.0;
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * fade);
  // A negative width is a length in the world [m].
  float world = max(-a_width * length(u_matrix.xy), 1.5 * u_ratio);
  float width = a_width < 0.0 ? world : a_width * u_ratio;
  gl_Position = toClip(capsule(toPixels(a_segment.xy), toPixels(a_segment.zw), width));
}`;

export const coloredEdgesFragment = `${HEAD}${CAPSULE_COVERAGE}
flat in vec4 v_color;
out vec4 color;
void main() { color = v_color * coverage(); }`;

export const bodyEdgesVertex = `${HEAD}${VIEW}${CAPSULE}${BODY}
in vec4 a_segment;
in vec4 a_color;
in float a_slot;
uniform float u_width;
flat out vec4 v_color;
void main() {
  vec4 pose = bodyPose(a_slot);
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * pose.w);
  vec2 a = toPixels(ofBody(pose, a_segment.xy)), b = toPixels(ofBody(pose, a_segment.zw));
  gl_Position = toClip(capsule(a, b, u_width));
}`;

export const bodyDiscsVertex = `${HEAD}${VIEW}${BODY}
in vec3 a_disc;    // centre, radius [m]
in vec4 a_color;
in float a_slot;
uniform float u_width;
uniform float u_scale;   // [pixels per metre]
flat out vec4 v_color;
flat out float v_radius;
out vec2 v_local;
void main() {
  vec4 pose = bodyPose(a_slot);
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * pose.w);
  v_radius = a_disc.z * u_scale;
  vec2 corner = 2.0 * vec2(float(gl_VertexID & 1), float((gl_VertexID >> 1) & 1)) - 1.0;
  v_local = corner * (v_radius + 0.5 * u_width + 1.0);
  gl_Position = toClip(toPixels(ofBody(pose, a_disc.xy)) + v_local);
}`;

export const bodyDiscsFragment = `${HEAD}
flat in vec4 v_color;
flat in float v_radius;
in vec2 v_local;
uniform float u_width;
uniform float u_opacity;   // of the inside
out vec4 color;
void main() {
  float d = length(v_local) - v_radius;
  float line = clamp(0.5 * u_width - abs(d) + 0.5, 0.0, 1.0);
  // A disc of a few pixels is opaque, so that it is visible from far away.
  float fill = clamp(0.5 - d, 0.0, 1.0) * mix(1.0, u_opacity, clamp((v_radius - 2.0) / 6.0, 0.0, 1.0));
  color = v_color * max(line, fill);
}`;

export const bodyFillVertex = `${HEAD}${VIEW}${BODY}
in vec2 a_point;
in vec4 a_color;
in float a_slot;
uniform float u_opacity;
flat out vec4 v_color;
void main() {
  vec4 pose = bodyPose(a_slot);
  v_color = vec4(a_color.rgb, 1.0) * (a_color.a * pose.w * u_opacity);
  gl_Position = toClip(toPixels(ofBody(pose, a_point)));
}`;

export const colorFragment = `${HEAD}
flat in vec4 v_color;
out vec4 color;
void main() { color = v_color; }`;

export const coloredTrianglesVertex = `${HEAD}${VIEW}
in vec2 a_point;
in vec4 a_color;
flat out vec4 v_color;
void main() {
  v_color = vec4(a_color.rgb, 1.0) * a_color.a;
  gl_Position = toClip(toPixels(a_point));
}`;

/** A grid of cells, drawn as a strip of two triangles. */
export const cellsVertex = `${HEAD}${VIEW}
uniform vec3 u_pose;     // of the corner of the first cell [m, rad]
uniform vec2 u_extent;   // [m]
out vec2 v_texel;
void main() {
  v_texel = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  vec2 p = v_texel * u_extent;
  float c = cos(u_pose.z), s = sin(u_pose.z);
  gl_Position = toClip(toPixels(u_pose.xy + vec2(c * p.x - s * p.y, s * p.x + c * p.y)));
}`;

/** Colours as in RViz. Of the cells of a pixel, the one with the largest value is drawn. */
export const cellsFragment = `${HEAD}
in vec2 v_texel;
uniform sampler2D u_cells;
uniform bool u_isCostmap;
out vec4 color;
const int SAMPLES = 4;
float cellAt(vec2 texel) {
  float value = floor(255.0 * texture(u_cells, texel).r + 0.5);
  return value > 127.5 ? value - 256.0 : value;
}
float largest() {
  vec2 span = fwidth(v_texel) * vec2(textureSize(u_cells, 0));
  if (max(span.x, span.y) <= 1.0) return cellAt(v_texel);
  float found = -128.0;
  for (int i = 0; i < SAMPLES * SAMPLES; i++) {
    vec2 part = (vec2(float(i % SAMPLES), float(i / SAMPLES)) + 0.5) / float(SAMPLES) - 0.5;
    found = max(found, cellAt(v_texel + part * fwidth(v_texel)));
  }
  return found;
}
vec4 mapColor(float value) { return vec4(vec3(1.0 - value / 100.0), 0.7); }
vec4 costColor(float value) {
  if (value == 0.0) return vec4(0.0);
  if (value == 99.0) return vec4(0.0, 1.0, 1.0, 0.7);
  if (value == 100.0) return vec4(1.0, 0.0, 1.0, 0.7);
  return vec4(value / 100.0, 0.0, 1.0 - value / 100.0, 0.7);
}
void main() {
  float value = largest();
  vec4 found = u_isCostmap ? costColor(value) : mapColor(value);
  if (value == -1.0) found = vec4(0.44, 0.54, 0.53, 0.7);
  if (value < -1.0) found = vec4(1.0, 0.0, 0.0, 0.7);
  if (value > 100.0) found = vec4(0.0, 1.0, 0.0, 0.7);
  color = vec4(found.rgb * found.a, found.a);
}`;

export const pointsVertex = `${HEAD}${VIEW}
in vec2 a_point;
uniform float u_pointSize;
void main() {
  gl_PointSize = u_pointSize;
  gl_Position = toClip(toPixels(a_point));
}`;

export const pointsFragment = `${HEAD}
uniform float u_pointSize;
uniform vec4 u_color;
out vec4 color;
void main() {
  float d = length(gl_PointCoord - 0.5) * u_pointSize;
  color = u_color * clamp(0.5 * u_pointSize - d + 0.5, 0.0, 1.0);
}`;

export const textVertex = `${HEAD}${VIEW}
in vec2 a_anchor;   // [m]
in vec4 a_box;      // offset and size [pixels]
in vec2 a_texel;    // offset in the atlas [texels]
uniform float u_atlasSize;
out vec2 v_texel;
void main() {
  vec2 corner = vec2(float((gl_VertexID >> 1) & 1), float(gl_VertexID & 1));
  v_texel = (a_texel + corner * a_box.zw) / u_atlasSize;
  vec2 anchor = floor(toPixels(a_anchor) + 0.5 * u_size) - 0.5 * u_size;
  gl_Position = toClip(anchor + vec2(a_box.x + corner.x * a_box.z, -(a_box.y + corner.y * a_box.w)));
}`;

export const textFragment = `${HEAD}
in vec2 v_texel;
uniform sampler2D u_atlas;   // red: letters, green: halo
uniform vec3 u_ink;
uniform vec3 u_halo;
out vec4 color;
void main() {
  vec2 texel = texture(u_atlas, v_texel).rg;
  float halo = 0.8 * max(texel.r, texel.g) * (1.0 - texel.r);
  color = vec4(u_ink * texel.r + u_halo * halo, texel.r + halo);
}`;

/** A triangle that contains the whole viewport. */
export const copyVertex = `${HEAD}
uniform vec4 u_part;   // offset and size of the copied part, as shares of the texture
out vec2 v_texel;
void main() {
  vec2 corner = 2.0 * vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  v_texel = u_part.xy + corner * u_part.zw;
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;

export const copyFragment = `${HEAD}
in vec2 v_texel;
uniform sampler2D u_texture;
out vec4 color;
void main() { color = texture(u_texture, v_texel); }`;
