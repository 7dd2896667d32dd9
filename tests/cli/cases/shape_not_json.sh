echo "{\"format\": " > s.json
texel bake s.json -o x.texel
