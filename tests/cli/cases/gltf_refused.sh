# Each in one line with its status.
try() { texel bake "$1" -o x.texel; echo "$?" >&2; }
G='{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}]'
printf 'glTF\2\0\0\0\377\0\0\0\1\0\0\0JSON' > cut.glb; try cut.glb
printf '{"asset":\n{"version":}}' > text.gltf; try text.gltf
printf '%s' '{"asset":{"version":"1.0"}}' > old.gltf; try old.gltf
printf '%s' "$G"',"extensionsRequired":["EXT_unheard_of"]}' > e.gltf; try e.gltf
printf '%s' "$G"',"nodes":[{"children":[0]}]}' > cycle.gltf; try cycle.gltf
printf '%s' "$G"',"nodes":[{"mesh":4}]}' > mesh.gltf; try mesh.gltf
M='"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]'
printf '%s' "$G,$M"',"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"gone.bin"}]}' > bin.gltf; try bin.gltf
printf '%s' "$G,$M"',"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"../a.bin"}]}' > out.gltf; try out.gltf
printf '%s' "$G,$M"',"bufferViews":[{"buffer":0,"byteLength":35}],"buffers":[{"byteLength":36,"uri":"z.bin"}]}' > view.gltf; head -c 36 /dev/zero > z.bin; try view.gltf
printf '%s' "$G"',"nodes":[{}]}' > empty.gltf; try empty.gltf
