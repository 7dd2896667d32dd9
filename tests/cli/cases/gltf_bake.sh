# Cards cut out by an embedded picture: read, baked, whole; then a changed picture beside the file means a new bake.
texel bake "$ROOT/tests/data/gltf/cards.glb" -o cards.texel -r 32 2>&1 | sed 's/, [0-9.]* s$//'
texel check cards.texel
printf '%s' '{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"buffers":[{"byteLength":60,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/"}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}],
"materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],"images":[{"uri":"a%20b.ppm"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}]}' > tri.gltf
printf 'P3 1 1 255 255 0 0\n' > 'a b.ppm'
texel bake tri.gltf -o tri.texel -r 8 --want density,color > /dev/null 2>&1; echo $?
texel bake tri.gltf -o tri.texel -r 8 --want density,color 2>&1 | grep -c 'up to date'
printf 'P3 1 1 255 0 255 0\n' > 'a b.ppm'
texel bake tri.gltf -o tri.texel -r 8 --want density,color 2>&1 | grep -c 'up to date'
tr -d '\n ' < tri.texel/manifest.json | grep -o '"mean_color":[^]]*'
