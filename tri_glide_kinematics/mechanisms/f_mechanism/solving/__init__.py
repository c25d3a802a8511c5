"""All positions of an F-mechanism at given crank angles."""
