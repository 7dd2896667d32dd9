texel compare a.texel b.texel
