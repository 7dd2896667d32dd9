"""Makes the glTF files of this folder with Blender 3.4 and its own exporter: blender -b --factory-startup --python make.py -- FOLDER"""
import math
import os
import sys

import bpy

FOLDER = sys.argv[sys.argv.index("--") + 1]


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, color, metallic=0.0, roughness=0.5):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    shader = m.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Roughness"].default_value = roughness
    return m, shader


def mesh(name, points, faces, uvs=None, parent=None):
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [], faces)
    if uvs:
        layer = data.uv_layers.new(name="UVMap")
        for loop in data.loops:
            layer.data[loop.index].uv = uvs[loop.vertex_index]
    data.update()
    thing = bpy.data.objects.new(name, data)
    thing.parent = parent
    bpy.context.collection.objects.link(thing)
    return thing


def export(name, **options):
    bpy.ops.export_scene.gltf(filepath=os.path.join(FOLDER, name), **options)


def leaf_picture(size=64):
    """An ellipse of green on nothing, its alpha soft at the edge."""
    image = bpy.data.images.new("leaf", size, size, alpha=True)
    pixels = []
    for y in range(size):
        for x in range(size):
            u, v = (x + 0.5) / size * 2 - 1, (y + 0.5) / size * 2 - 1
            edge = math.hypot(u / 0.6, v / 0.95)
            alpha = min(max((1 - edge) * 6 + 0.5, 0), 1)
            vein = 0.8 if abs(u) < 0.04 else 1.0
            pixels += [0.25 * vein + 0.1 * (v + 1), 0.55 * vein + 0.1 * v, 0.12, alpha]
    image.pixels = pixels
    image.pack()
    return image


def cards():
    """Three crossed cards, their leaf cut out by the picture's alpha (MASK), on a stem that is a cylinder."""
    clear()
    leaf, shader = material("leaf", (1, 1, 1), roughness=0.6)
    texture = leaf.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = leaf_picture()
    leaf.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    leaf.node_tree.links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    leaf.blend_method = "CLIP"
    leaf.alpha_threshold = 0.5
    root = bpy.data.objects.new("plant", None)
    bpy.context.collection.objects.link(root)
    for i in range(3):
        card = mesh(f"card{i}", [(-0.5, 0, 0.4), (0.5, 0, 0.4), (0.5, 0, 1.4), (-0.5, 0, 1.4)], [(0, 1, 2, 3)], [(0, 0), (1, 0), (1, 1), (0, 1)], root)
        card.rotation_euler = (0, 0, i * math.pi / 3)
        card.data.materials.append(leaf)
    n = 12
    ring = [(0.04 * math.cos(2 * math.pi * i / n), 0.04 * math.sin(2 * math.pi * i / n)) for i in range(n)]
    points = [(x, y, 0) for x, y in ring] + [(x, y, 1) for x, y in ring]
    faces = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)] + [tuple(reversed(range(n))), tuple(range(n, 2 * n))]
    stem = mesh("stem", points, faces, parent=root)
    stem.data.materials.append(material("stem", (0.2, 0.12, 0.05), roughness=0.9)[0])
    export("cards.glb", export_format="GLB")


CUBE = ([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])


def nested():
    """A cube in a turned, scaled and mirrored frame within another, of three materials."""
    clear()
    outer = bpy.data.objects.new("outer", None)
    bpy.context.collection.objects.link(outer)
    outer.location, outer.rotation_euler = (3, 0, 0), (0, 0, math.pi / 2)
    inner = bpy.data.objects.new("inner", None)
    bpy.context.collection.objects.link(inner)
    inner.parent, inner.location, inner.scale = outer, (0, 2, 1), (-0.5, 1, 2)
    cube = mesh("cube", *CUBE, parent=inner)
    cube.rotation_euler = (0, 0, math.pi / 2)
    for i, (name, color, metallic, roughness) in enumerate([("red", (0.8, 0.1, 0.1), 0, 0.5), ("gold", (1, 0.7, 0.3), 0.75, 0.25), ("grey", (0.5, 0.5, 0.5), 0, 1)]):
        cube.data.materials.append(material(name, color, metallic, roughness)[0])
    for i, face in enumerate(cube.data.polygons):
        face.material_index = i % 3
    export("nested.gltf", export_format="GLTF_EMBEDDED")


def colors():
    """A cube with a colour of its own on each corner, in parts of its own (.gltf and .bin)."""
    clear()
    cube = mesh("cube", *CUBE)
    cube.data.materials.append(material("paint", (1, 1, 1))[0])
    layer = cube.data.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    for i, (x, y, z) in enumerate(CUBE[0]):
        layer.data[i].color = ((x + 1) / 2, (y + 1) / 2, (z + 1) / 4, 1)
    export("colors.gltf", export_format="GLTF_SEPARATE")


cards()
nested()
colors()
